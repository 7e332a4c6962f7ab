//! Tables as they are written, on a workstation.

use alloc::string::String;
use alloc::vec::Vec;
use core::fmt::Write;

use crate::checksum::Checksum;
use crate::table::{Table, padded};

/// Named arrays that become a [`Table`], or a Rust source of constants.
///
/// ```
/// use fredholm_embedded::{Table, TableBuilder};
///
/// let mut builder = TableBuilder::new("circle");
/// builder.numbers("v", &[1.5_f32, 2.5]);
/// builder.numbers("absorb", &[0.2_f64]);
/// # #[cfg(feature = "zerocopy")]
/// # {
/// # let words = |bytes: Vec<u8>| -> Vec<u64> {
/// #     bytes.chunks(8).map(|c| u64::from_le_bytes(c.try_into().unwrap())).collect()
/// # };
/// # let aligned = words(builder.to_bytes());
/// # use fredholm_embedded::zerocopy::IntoBytes;
/// # let bytes = aligned.as_bytes();
/// let table = Table::read(bytes, "circle")?;
/// assert_eq!(table.slice::<f32>("v")?, [1.5, 2.5]);
/// assert_eq!(table.one::<f64>("absorb")?, 0.2);
/// assert!(builder.to_source().contains("pub(crate) static V: [f32; 2] = [1.5, 2.5];"));
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
    /// The name of the element's type in Rust.
    element: String,
    size: usize,
    bytes: Vec<u8>,
    texts: Vec<String>,
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
    /// The name of the element's type in Rust.
    const NAME: &'static str;
    /// The bytes of the number, little endian.
    fn bytes(self) -> impl Iterator<Item = u8>;
    /// The number as a literal that is read as the same bits.
    fn literal(self) -> String;
}

macro_rules! number {
    ($number:ident) => {
        impl Number for $number {
            const NAME: &'static str = stringify!($number);
            fn bytes(self) -> impl Iterator<Item = u8> {
                self.to_le_bytes().into_iter()
            }
            fn literal(self) -> String {
                alloc::format!("{self:?}")
            }
        }
    };
}
number!(u8);
number!(u32);
number!(f32);
number!(f64);

impl TableBuilder {
    /// No arrays yet. The `kind` has at most 8 letters.
    #[must_use]
    pub const fn new(kind: &'static str) -> Self {
        Self {
            kind,
            sections: Vec::new(),
        }
    }

    /// An array of numbers. The name has 1 to 8 letters.
    pub fn numbers<T: Number>(&mut self, name: &'static str, values: &[T]) {
        self.sections.push(Section {
            name,
            element: T::NAME.into(),
            size: size_of::<T>(),
            bytes: values.iter().flat_map(|value| value.bytes()).collect(),
            texts: values.iter().map(|value| value.literal()).collect(),
        });
    }

    /// An array of records, of which `element` is the type in Rust and `size` its size; each comes as
    /// its bytes (filled up with zeros) and as an expression in Rust.
    pub fn records(
        &mut self,
        name: &'static str,
        element: &str,
        size: usize,
        values: impl IntoIterator<Item = (Vec<u8>, String)>,
    ) {
        let (mut bytes, mut texts) = (Vec::new(), Vec::new());
        for (mut record, text) in values {
            record.resize(size, 0);
            bytes.append(&mut record);
            texts.push(text);
        }
        self.sections.push(Section {
            name,
            element: element.into(),
            size,
            bytes,
            texts,
        });
    }

    /// The compact form: what [`Table::read`] reads.
    #[must_use]
    pub fn to_bytes(&self) -> Vec<u8> {
        let mut rest: Vec<u8> = padded(self.kind).into();
        for section in &self.sections {
            rest.extend(padded(section.name));
            for word in [section.size, section.texts.len()] {
                rest.extend((word as u32).to_le_bytes());
            }
        }
        for section in &self.sections {
            rest.extend(&section.bytes);
            rest.resize(rest.len().next_multiple_of(8), 0);
        }
        let mut bytes: Vec<u8> = Table::MAGIC.into();
        bytes.extend(Table::VERSION.to_le_bytes());
        bytes.extend((self.sections.len() as u16).to_le_bytes());
        bytes.extend(((rest.len() + 16) as u32).to_le_bytes());
        let sum = Checksum::new().bytes(&bytes).bytes(&rest).finish();
        bytes.extend(sum.to_le_bytes());
        bytes.extend(rest);
        bytes
    }

    /// The tables as Rust source: a `pub(crate) static` of every array, its name in capitals.
    #[must_use]
    pub fn to_source(&self) -> String {
        let mut text = String::new();
        for section in &self.sections {
            let name = section.name.to_ascii_uppercase();
            let count = section.texts.len();
            let one_line = alloc::format!(
                "pub(crate) static {name}: [{}; {count}] = [{}];\n",
                section.element,
                section.texts.join(", ")
            );
            if one_line.len() <= 100 {
                text.push_str(&one_line);
                continue;
            }
            // Writing to a string does not fail.
            let _ = writeln!(
                text,
                "pub(crate) static {name}: [{}; {count}] = [",
                section.element
            );
            let mut column = 0;
            for value in &section.texts {
                // As many as fit, with comma and space, into 100 columns.
                let width = value.chars().count() + 2;
                if column == 0 || column + width > 100 {
                    text.push_str(if column == 0 { "   " } else { "\n   " });
                    column = 3;
                }
                let _ = write!(text, " {value},");
                column += width;
            }
            text.push_str("\n];\n");
        }
        text
    }
}
