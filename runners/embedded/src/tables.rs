//! Tables from a workstation, read where they lie.

use core::fmt;
#[cfg(feature = "zerocopy")]
use core::num::NonZeroU32;

#[cfg(feature = "zerocopy")]
use fredholm_core::sampled::StepControl;

#[cfg(feature = "zerocopy")]
use zerocopy::{FromBytes, Immutable};

use crate::checksum::Checksum;

/// Bytes at an address that is a multiple of 8, as [`Tables`] ask for: `include_bytes!` alone
/// promises no alignment.
///
/// ```
/// use fredholm_embedded::Aligned;
///
/// # const TEXT: &str = stringify!(
/// static TABLE: &Aligned<[u8]> = &Aligned(*include_bytes!("circle.bin"));
/// # );
/// static BYTES: &Aligned<[u8]> = &Aligned(*b"FHTB");
/// assert_eq!(BYTES.0.as_ptr() as usize % 8, 0);
/// ```
#[derive(Clone, Copy, Debug)]
#[repr(C, align(8))]
pub struct Aligned<T: ?Sized>(pub T);

/// Named arrays that a `TableBuilder` wrote, read in place, from flash for instance. Their layout is in the crate's documentation.
///
/// They are checked once, as a whole; then every array is a slice of the bytes.
#[derive(Clone, Copy, Debug)]
pub struct Tables<'a> {
    bytes: &'a [u8],
    sections: u16,
}

/// Why bytes are no tables, or have not what is asked for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum TableError {
    /// The bytes do not begin as a table does.
    Foreign,
    /// The table was written by another version of this crate.
    Version {
        /// The version that wrote the table.
        found: u16,
    },
    /// The table is of another kind of problem.
    Kind,
    /// There are fewer bytes than the table had, or more.
    Length {
        /// The bytes of the whole table.
        expected: usize,
        /// The bytes that are there.
        found: usize,
    },
    /// The checksum is wrong: a byte was lost or changed.
    Checksum,
    /// The list of arrays does not fit the bytes.
    Directory {
        /// The first array that does not, from 0; the number of arrays where bytes are left behind them.
        array: usize,
    },
    /// The bytes do not lie at a multiple of 8; see [`Aligned`].
    Alignment,
    /// This machine stores the last byte of a number first, and tables are read in place.
    BigEndian,
    /// There is no array of this name.
    Missing {
        /// The name.
        name: &'static str,
    },
    /// The elements of this array have another size: f64 where f32 is asked for, for instance.
    Element {
        /// The name of the array.
        name: &'static str,
        /// Bytes of an element in the table.
        found: usize,
    },
    /// The array has another number of elements than is asked for, or a number that cannot be.
    Elements {
        /// The name of the array.
        name: &'static str,
    },
}

impl fmt::Display for TableError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Foreign => f.write_str("this is no table: its first bytes are others"),
            Self::Version { found } => {
                let here = Tables::VERSION;
                write!(f, "a table of version {here} is needed, not {found}")
            }
            Self::Kind => f.write_str("the table is of another kind of problem"),
            Self::Length { expected, found } => {
                write!(f, "the table has {expected} bytes, and {found} are here")
            }
            Self::Checksum => f.write_str("the table is damaged: its checksum is wrong"),
            Self::Directory { array } => {
                write!(
                    f,
                    "the table's array number {array} (from 0) does not fit its bytes"
                )
            }
            Self::Alignment => {
                f.write_str("a table must lie at a multiple of 8 bytes: wrap it in `Aligned`")
            }
            Self::BigEndian => f.write_str(
                "tables are little endian and read in place, and this machine is big endian",
            ),
            Self::Missing { name } => write!(f, "the table has no array `{name}`"),
            Self::Element { name, found } => write!(
                f,
                "the elements of the table's array `{name}` have {found} bytes: it is of another \
                 type"
            ),
            Self::Elements { name } => {
                write!(
                    f,
                    "the table's array `{name}` has other elements than are asked for"
                )
            }
        }
    }
}

impl core::error::Error for TableError {}

/// An entry of the directory.
struct Section<'a> {
    name: [u8; Tables::NAME],
    element: usize,
    #[cfg_attr(not(feature = "zerocopy"), expect(dead_code))]
    bytes: &'a [u8],
}

impl<'a> Tables<'a> {
    pub(crate) const MAGIC: [u8; 4] = *b"FHTB";
    pub(crate) const VERSION: u16 = 1;
    /// Bytes of a name.
    pub(crate) const NAME: usize = 8;
    /// Bytes before the directory.
    pub(crate) const HEAD: usize = 24;
    /// Bytes of an entry of the directory.
    pub(crate) const ENTRY: usize = 16;

    /// The table of a problem of this `kind` ("circle", "cube"), checked.
    ///
    /// # Errors
    /// [`TableError`] but for its last three.
    pub fn read(bytes: &'a [u8], kind: &str) -> Result<Self, TableError> {
        if cfg!(target_endian = "big") {
            return Err(TableError::BigEndian);
        }
        let Some((head, rest)) = bytes.split_first_chunk::<{ Tables::HEAD }>() else {
            return Err(if bytes.starts_with(&Self::MAGIC) {
                TableError::Length {
                    expected: Self::HEAD,
                    found: bytes.len(),
                }
            } else {
                TableError::Foreign
            });
        };
        let [
            m0,
            m1,
            m2,
            m3,
            v0,
            v1,
            s0,
            s1,
            l0,
            l1,
            l2,
            l3,
            c0,
            c1,
            c2,
            c3,
            name @ ..,
        ] = *head;
        if [m0, m1, m2, m3] != Self::MAGIC {
            return Err(TableError::Foreign);
        }
        let found = u16::from_le_bytes([v0, v1]);
        if found != Self::VERSION {
            return Err(TableError::Version { found });
        }
        let expected = u32::from_le_bytes([l0, l1, l2, l3]) as usize;
        if bytes.len() != expected {
            return Err(TableError::Length {
                expected,
                found: bytes.len(),
            });
        }
        let before = [m0, m1, m2, m3, v0, v1, s0, s1, l0, l1, l2, l3];
        let sum = Checksum::new().bytes(&before).bytes(&name).bytes(rest);
        if sum.finish() != u32::from_le_bytes([c0, c1, c2, c3]) {
            return Err(TableError::Checksum);
        }
        if name != padded(kind) {
            return Err(TableError::Kind);
        }
        if !bytes.as_ptr().addr().is_multiple_of(8) {
            return Err(TableError::Alignment);
        }
        let table = Self {
            bytes,
            sections: u16::from_le_bytes([s0, s1]),
        };
        // Every entry lies within the bytes, and the last one ends with them.
        let mut sections = table.sections();
        let array = sections.by_ref().take_while(Section::is_whole).count();
        if array == usize::from(table.sections) && sections.data.is_empty() {
            Ok(table)
        } else {
            Err(TableError::Directory { array })
        }
    }

    fn sections(&self) -> Sections<'a> {
        let rest = self.bytes.get(Self::HEAD..).unwrap_or(&[]);
        let directory = usize::from(self.sections) * Self::ENTRY;
        let (directory, data) = rest.split_at_checked(directory).unwrap_or((&[], rest));
        Sections {
            directory: directory.as_chunks().0,
            data,
        }
    }
}

/// Names of the arrays of a neighbour equation from steps.
#[cfg(any(feature = "alloc", feature = "zerocopy"))]
pub(crate) mod names {
    pub(crate) const V: &str = "v";
    pub(crate) const CONTROL: &str = "control";
    pub(crate) const INTEGRAL: &str = "integral";
    pub(crate) const EVENTS: &str = "events";
    pub(crate) const OF_EVENTS: &str = "ofevents";
    pub(crate) const STEPS: &str = "steps";
}

#[cfg(feature = "zerocopy")]
impl<'a> Tables<'a> {
    /// The array of this name, in place. `T` is what was written: f32, f64, u32, u8, or a problem's own record.
    ///
    /// # Errors
    /// [`TableError::Missing`], [`TableError::Element`].
    pub fn get<T: FromBytes + Immutable>(&self, name: &'static str) -> Result<&'a [T], TableError> {
        let bytes = self.array(name, size_of::<T>())?;
        let found = size_of::<T>();
        <[T]>::ref_from_bytes(bytes).map_err(|_| TableError::Element { name, found })
    }

    /// The bytes of the array of this name, whose elements have so many.
    // Once for all types of elements, and gone from the stack while walks use it.
    #[inline(never)]
    fn array(&self, name: &'static str, element: usize) -> Result<&'a [u8], TableError> {
        let wanted = padded(name);
        let found = self.sections().find(|section| section.name == wanted);
        match found {
            None => Err(TableError::Missing { name }),
            Some(section) if section.element == element => Ok(section.bytes),
            Some(Section { element: found, .. }) => Err(TableError::Element { name, found }),
        }
    }

    /// The only element of the array of this name.
    ///
    /// # Errors
    /// As [`get`](Self::get), and [`TableError::Elements`].
    pub fn one<T: FromBytes + Immutable>(&self, name: &'static str) -> Result<&'a T, TableError> {
        match self.get(name)? {
            [one] => Ok(one),
            _ => Err(TableError::Elements { name }),
        }
    }

    /// The tables of a neighbour equation from steps ([`Sampled`](fredholm_core::sampled::Sampled)), and the number of steps wherever G
    /// is scored.
    ///
    /// # Errors
    /// As [`get`](Self::get).
    pub fn step_control<F: FromBytes + Immutable>(
        &self,
    ) -> Result<(StepControl<'a, F>, NonZeroU32), TableError> {
        let not_two = TableError::Elements { name: names::STEPS };
        let [per_axis, count] = *self.get::<u32>(names::STEPS)? else {
            return Err(not_two);
        };
        let control = StepControl {
            v: self.get(names::V)?,
            control: self.get(names::CONTROL)?,
            integral: self.get(names::INTEGRAL)?,
            per_axis,
            events: self.get(names::EVENTS)?,
            of_events: self.get(names::OF_EVENTS)?,
        };
        Ok((control, NonZeroU32::new(count).ok_or(not_two)?))
    }
}

/// The arrays that are still to come.
struct Sections<'a> {
    directory: &'a [[u8; Tables::ENTRY]],
    data: &'a [u8],
}

impl<'a> Iterator for Sections<'a> {
    type Item = Section<'a>;

    fn next(&mut self) -> Option<Section<'a>> {
        let (entry, directory) = self.directory.split_first()?;
        let [name @ .., e0, e1, e2, e3, c0, c1, c2, c3] = *entry;
        let element = u32::from_le_bytes([e0, e1, e2, e3]) as usize;
        let count = u32::from_le_bytes([c0, c1, c2, c3]) as usize;
        let length = element.checked_mul(count)?;
        let (bytes, rest) = self.data.split_at_checked(length)?;
        // The next array begins at a multiple of 8.
        self.data = rest.get(length.wrapping_neg() % 8..)?;
        self.directory = directory;
        Some(Section {
            name,
            element,
            bytes,
        })
    }
}

impl Section<'_> {
    fn is_whole(&self) -> bool {
        self.element > 0 && self.name.first().is_some_and(|&byte| byte != 0)
    }
}

/// A name, filled up with zeros.
pub(crate) fn padded(name: &str) -> [u8; Tables::NAME] {
    let mut bytes = [0; Tables::NAME];
    for (to, from) in bytes.iter_mut().zip(name.bytes()) {
        *to = from;
    }
    bytes
}
