//! `[problem.channels]`: a problem of any kind in several channels, which differ in what their tables say.

use std::sync::Arc;

use fredholm::channels::{ChannelModels, check_names};
use fredholm::{Error, Subject, Target};

use super::{Kind, ReadKind};
use crate::place::{InputError, Place};
use crate::section::Section;
use crate::{ProblemFile, Resolution, What};

/// A problem in several channels, of which each is a problem of one kind.
#[derive(Debug)]
struct Channels {
    names: Vec<String>,
    /// The problem of each channel. There is one.
    kinds: Vec<Arc<dyn Kind>>,
    place: Place,
}

/// Reads the keys of a kind, once for every channel if there are some.
pub(super) fn read(
    mut section: Section<'_, '_>,
    read: ReadKind,
) -> Result<Arc<dyn Kind>, InputError> {
    let whole = section.span.clone();
    let Some(variants) = section.variants("channels")? else {
        return read(section);
    };
    let names: Vec<String> = variants.iter().map(|(name, _)| name.clone()).collect();
    check_names(&names).map_err(|error| section.error(error))?;
    let kinds = variants.into_iter().map(|(_, variant)| read(variant));
    Ok(Arc::new(Channels {
        names,
        kinds: kinds.collect::<Result<_, _>>()?,
        place: Place::File(whole),
    }))
}

impl Channels {
    fn first(&self) -> &dyn Kind {
        &*self.kinds[0]
    }
}

impl Kind for Channels {
    fn validate(&self, file: &ProblemFile) -> Result<(), InputError> {
        self.kinds.iter().try_for_each(|kind| kind.validate(file))
    }

    fn validate_target(&self, file: &ProblemFile, what: &What) -> Result<(), InputError> {
        let mut all = self.kinds.iter();
        all.try_for_each(|kind| kind.validate_target(file, what))
    }

    fn most_degree(&self) -> (usize, &'static str) {
        self.first().most_degree()
    }

    fn resolve(&self, file: &ProblemFile) -> Result<(Resolution, Vec<Target>), InputError> {
        let mut models = Vec::with_capacity(self.kinds.len());
        let mut asked = Vec::new();
        for kind in &self.kinds {
            let (resolution, targets) = kind.resolve(file)?;
            models.push(resolution.into_model());
            // Their places are those of one space.
            asked = targets;
        }
        let channels = ChannelModels::from_boxed(self.names.clone(), models)
            .map_err(|error| file.error(&self.place, error))?;
        Ok((Resolution::Other(Box::new(channels)), asked))
    }

    fn place(&self, subject: Subject) -> Option<Place> {
        self.kinds.iter().find_map(|kind| kind.place(subject))
    }

    fn explain(&self, file: &ProblemFile, error: &Error) -> Option<InputError> {
        let mut all = self.kinds.iter();
        all.find_map(|kind| kind.explain(file, error))
    }

    fn remarks(&self, file: &ProblemFile) -> Vec<String> {
        let mut all: Vec<String> = Vec::new();
        for remark in self.kinds.iter().flat_map(|kind| kind.remarks(file)) {
            if !all.contains(&remark) {
                all.push(remark);
            }
        }
        all
    }

    fn identity(&self, file: &ProblemFile) -> Result<String, InputError> {
        let own = |(name, kind): (&String, &Arc<dyn Kind>)| {
            Ok(format!("{name:?}:{};", kind.identity(file)?))
        };
        self.names.iter().zip(&self.kinds).map(own).collect()
    }

    fn has_components(&self) -> bool {
        self.first().has_components()
    }
}
