//! Tables as they are written, on a workstation.

use alloc::vec::Vec;
use core::num::NonZeroU32;

use fredholm_core::sampled::StepControl;

use crate::checksum::Checksum;
use crate::tables::{Tables, names, padded};

/// Named arrays that become [`Tables`].
///
/// ```
/// use fredholm_embedded::TableBuilder;
///
/// let mut builder = TableBuilder::new("circle");
/// builder.numbers("v", &[1.5_f32, 2.5]);
/// // Records of a `repr(C)` type, number by number.
/// #[repr(C)]
/// struct Slot {
///     end: f64,
///     cell: u32,
/// }
/// builder.records("slots", &[Slot { end: 0.5, cell: 7 }], |slot, fields| {
///     fields.add(&[slot.end]);
///     fields.add(&[slot.cell]);
/// });
/// # #[cfg(feature = "zerocopy")]
/// # {
/// # use fredholm_embedded::{Tables, zerocopy::IntoBytes};
/// # let words: Vec<u64> = (builder.to_bytes().chunks(8)).map(|c| u64::from_le_bytes(c.try_into().unwrap())).collect();
/// # let bytes = words.as_bytes();
/// let tables = Tables::read(bytes, "circle")?;
/// assert_eq!(tables.get::<f32>("v")?, [1.5, 2.5]);
/// # }
/// # Ok::<(), fredholm_embedded::TableError>(())
/// ```
#[derive(Clone, Debug)]
pub struct TableBuilder {
    kind: &'static str,
    sections: Vec<Section>,
}

#[derive(Clone, Debug)]
struct Section {
    name: &'static str,
    /// Bytes of an element.
    size: usize,
    bytes: Vec<u8>,
}

mod sealed {
    pub trait Sealed {}
    impl Sealed for u8 {}
    impl Sealed for u32 {}
    impl Sealed for f32 {}
    impl Sealed for f64 {}
}

/// A number of a table: `u8`, `u32`, `f32` or `f64`.
pub trait Number: sealed::Sealed + Copy {
    /// The bytes of the number, little endian.
    fn bytes(self) -> impl AsRef<[u8]>;
}

macro_rules! number {
    ($($number:ident)*) => {$(
        impl Number for $number {
            fn bytes(self) -> impl AsRef<[u8]> {
                self.to_le_bytes()
            }
        }
    )*};
}
number!(u8 u32 f32 f64);

/// The fields of a record, as they are written: each at a multiple of its size, as `repr(C)` has them.
#[derive(Debug)]
pub struct Fields<'b> {
    bytes: &'b mut Vec<u8>,
    /// Where the record begins.
    start: usize,
}

impl Fields<'_> {
    /// Adds the next numbers of the record.
    pub fn add<T: Number>(&mut self, numbers: &[T]) {
        self.pad(size_of::<T>());
        for number in numbers {
            self.bytes.extend_from_slice(number.bytes().as_ref());
        }
    }

    /// Fills up with zeros to a multiple of so many bytes.
    fn pad(&mut self, to: usize) {
        let length = self.bytes.len() - self.start;
        let padded = self.start + length.next_multiple_of(to);
        self.bytes.resize(padded, 0);
    }
}

impl TableBuilder {
    /// No arrays yet. The `kind` has at most 8 letters.
    #[must_use]
    pub const fn new(kind: &'static str) -> Self {
        Self {
            kind,
            sections: Vec::new(),
        }
    }

    /// Adds an array of numbers. The name has 1 to 8 letters.
    pub fn numbers<T: Number>(&mut self, name: &'static str, values: &[T]) {
        self.records(name, values, |&value, fields| fields.add(&[value]));
    }

    /// Adds an array of records of a `repr(C)` type, whose numbers `write` adds in the order of its fields.
    ///
    /// # Panics
    /// If that makes a record of another size.
    pub fn records<R>(
        &mut self,
        name: &'static str,
        records: &[R],
        write: impl Fn(&R, &mut Fields<'_>),
    ) {
        let size = size_of::<R>();
        let mut bytes = Vec::with_capacity(size_of_val(records));
        for record in records {
            let start = bytes.len();
            let mut fields = Fields {
                bytes: &mut bytes,
                start,
            };
            write(record, &mut fields);
            fields.pad(align_of::<R>());
            assert_eq!(bytes.len() - start, size, "a record of `{name}`");
        }
        self.sections.push(Section { name, size, bytes });
    }

    /// Adds a neighbour equation from steps: what [`Tables::step_control`] reads.
    pub fn step_control<F: Number>(&mut self, control: &StepControl<'_, F>, steps: NonZeroU32) {
        self.numbers(names::V, control.v);
        self.numbers(names::CONTROL, control.control);
        self.numbers(names::INTEGRAL, control.integral);
        self.numbers(names::EVENTS, control.events);
        self.numbers(names::OF_EVENTS, control.of_events);
        self.numbers(names::STEPS, &[control.per_axis, steps.get()]);
    }

    /// The bytes that [`Tables::read`] reads.
    #[must_use]
    pub fn to_bytes(&self) -> Vec<u8> {
        let mut rest: Vec<u8> = padded(self.kind).into();
        for section in &self.sections {
            rest.extend(padded(section.name));
            let count = section.bytes.len().checked_div(section.size).unwrap_or(0);
            for word in [section.size, count] {
                rest.extend((word as u32).to_le_bytes());
            }
        }
        for section in &self.sections {
            rest.extend(&section.bytes);
            rest.resize(rest.len().next_multiple_of(8), 0);
        }
        let mut bytes: Vec<u8> = Tables::MAGIC.into();
        bytes.extend(Tables::VERSION.to_le_bytes());
        bytes.extend((self.sections.len() as u16).to_le_bytes());
        bytes.extend(((rest.len() + 16) as u32).to_le_bytes());
        let sum = Checksum::new().bytes(&bytes).bytes(&rest).finish();
        bytes.extend(sum.to_le_bytes());
        bytes.extend(rest);
        bytes
    }
}
