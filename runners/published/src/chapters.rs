//! The chapters, in the order of the page.

use crate::{Chapter, Check, Known, Size, Walks, equations, rooms};

/// All numbers that were published, in chapters.
///
/// ```
/// let all = fredholm_published::chapters();
/// let numbers: usize = all.iter().map(|chapter| chapter.checks.len()).sum();
/// assert!(all[0].source.starts_with("Heinrich 1995") && numbers > 20);
/// ```
#[must_use]
pub fn chapters() -> Vec<Chapter> {
    vec![
        Chapter {
            source: "Heinrich 1995, section 5, (57) and (58): F such that u = C + D sin(l s)",
            checks: equations::harmonics(),
        },
        Chapter {
            source: "Eigenvalues 1/(1 - 4 k^2) of the circle's kernel: u as a Fourier series",
            checks: vec![equations::lamp()],
        },
        Chapter {
            source: "Atkinson and Shampine 2008 (ACM TOMS 35, algorithm 876), and tensor products",
            checks: equations::models(),
        },
        Chapter {
            source: "Form factors of fully visible surfaces: crossed strings (Hottel 1954); Howell's catalogue",
            checks: rooms::strings(),
        },
        Chapter {
            source: "Form factors past corners and obstacles: independent computations to ten or twelve digits",
            checks: rooms::obstacles(),
        },
        Chapter {
            source: "FACET (UCID-19887, Lawrence Livermore 1983), a View2D deck",
            checks: vec![rooms::facet()],
        },
        Chapter {
            source: "Light in rooms: graded Nystrom solutions (square, polygons), the furnace u = 1",
            checks: rooms::rooms(),
        },
        Chapter {
            source: "Heinrich 1995, section 5, the table (its random choices are not printed)",
            checks: vec![Check::Experiment(EXPERIMENT.to_vec())],
        },
        Chapter {
            source: "Heinrich and Mathe 1993: standard deviation ~ n^(-1/d), error ~ cost^(-1/(2d) - 1/2)",
            checks: (1..=3).map(Check::Exponents).collect(),
        },
    ]
}

/// A target, its words in a file, and its value.
pub(crate) fn known(name: &str, place: &str, expected: f64) -> Known {
    Known {
        name: name.to_owned(),
        place: place.to_owned(),
        expected,
    }
}

/// Walks on the problem with these sections before its targets.
pub(crate) fn walks(name: &str, file: &str, targets: Vec<Known>) -> Check {
    Check::Walks(Walks {
        name: name.to_owned(),
        file: file.to_owned(),
        targets,
    })
}

/// n and the printed √Var^mc and √Var^pmc of most walks.
const EXPERIMENT: [Size; 3] = [
    Size {
        cells: 10,
        plain: 7.67,
        preconditioned: 0.693,
    },
    Size {
        cells: 100,
        plain: 7.67,
        preconditioned: 0.0980,
    },
    Size {
        cells: 1000,
        plain: 7.68,
        preconditioned: 0.008_80,
    },
];
