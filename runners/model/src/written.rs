//! Options as they are written into files of runs: words, and numbers with their kind.

use fredholm_core::Tolerance;
use serde::de::Error;
use serde::{Deserialize, Deserializer, Serialize, Serializer};

use crate::Choices;

/// An option with a few values, by its word.
pub(crate) mod choice {
    use super::{Choices, Deserialize, Deserializer, Error, Serialize, Serializer};

    pub(crate) fn serialize<T: Choices, S: Serializer>(
        value: &T,
        to: S,
    ) -> Result<S::Ok, S::Error> {
        value.word().serialize(to)
    }

    pub(crate) fn deserialize<'de, T: Choices, D: Deserializer<'de>>(
        from: D,
    ) -> Result<T, D::Error> {
        let word = String::deserialize(from)?;
        T::of_word(&word).ok_or_else(|| Error::custom(format_args!("no such word: {word:?}")))
    }
}

/// An option with a few values that may be open, by its word.
pub(crate) mod open_choice {
    use super::{Choices, Deserialize, Deserializer, Error, Serialize, Serializer};

    pub(crate) fn serialize<T: Choices, S: Serializer>(
        value: &Option<T>,
        to: S,
    ) -> Result<S::Ok, S::Error> {
        value.map(T::word).serialize(to)
    }

    pub(crate) fn deserialize<'de, T: Choices, D: Deserializer<'de>>(
        from: D,
    ) -> Result<Option<T>, D::Error> {
        let word = Option::<String>::deserialize(from)?;
        let of = |word: String| {
            T::of_word(&word).ok_or_else(|| Error::custom(format_args!("no such word: {word:?}")))
        };
        word.map(of).transpose()
    }
}

/// A tolerance, absolute or relative.
pub(crate) mod tolerance {
    use super::{Deserialize, Deserializer, Serialize, Serializer, Tolerance};

    #[derive(Serialize, Deserialize)]
    #[serde(rename_all = "lowercase")]
    enum Written {
        Absolute(f64),
        Relative(f64),
        FourthRoot(f64),
    }

    pub(crate) fn serialize<S: Serializer>(
        value: &Option<Tolerance>,
        to: S,
    ) -> Result<S::Ok, S::Error> {
        let written = value.map(|tolerance| match tolerance {
            Tolerance::Absolute(error) => Written::Absolute(error),
            Tolerance::Relative(error) => Written::Relative(error),
            Tolerance::FourthRoot(error) => Written::FourthRoot(error),
        });
        written.serialize(to)
    }

    pub(crate) fn deserialize<'de, D: Deserializer<'de>>(
        from: D,
    ) -> Result<Option<Tolerance>, D::Error> {
        let written = Option::<Written>::deserialize(from)?;
        Ok(written.map(|written| match written {
            Written::Absolute(error) => Tolerance::Absolute(error),
            Written::Relative(error) => Tolerance::Relative(error),
            Written::FourthRoot(error) => Tolerance::FourthRoot(error),
        }))
    }
}
