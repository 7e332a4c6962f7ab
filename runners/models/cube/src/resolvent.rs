//! Resolvent walks of a cube.

use fredholm_cube::ScalarField as _;
use fredholm_model::resolvent::{
    self, ByDensity, Functional, Grid, RegularKind, ResolventAnswer, ResolventQuestion,
    ResolventSizes,
};
use fredholm_model::{Error, Region};

use super::CubeModel;
use super::functions::{CubeScalar, ModelCube, Watched, WeightOf, Which, watch, with_values};

/// The numbers of cells of an axis to choose from.
const LEVELS: [usize; 18] = [
    1, 2, 3, 4, 6, 8, 12, 16, 24, 32, 48, 64, 96, 128, 192, 256, 384, 512,
];

impl<'v, F: CubeScalar, const D: usize> RegularKind<Grid<ByDensity<ModelCube<'v, F, D>>>>
    for Watched<'v, F>
{
    fn functional<'s>(
        &'s self,
        _: &Grid<ByDensity<ModelCube<'v, F, D>>>,
        region: &Region,
    ) -> Result<Functional<'s, [F; D]>, Error> {
        Ok(match region {
            Region::Point(x) => Functional::Point(self.domain().unit(x)),
            region => match WeightOf::region(region) {
                None => Functional::Mean,
                Some(WeightOf::Own(number)) => {
                    let weight = self.function(Which::Weight(WeightOf::Own(number)));
                    Functional::Weight(Box::new(move |x| weight.value(x).to_f64()))
                }
                Some(WeightOf::Given(weight)) => {
                    let weight = weight.clone();
                    Functional::Weight(Box::new(move |x| {
                        let of = Which::Weight(WeightOf::Given(&weight));
                        self.function(of).value(x).to_f64()
                    }))
                }
            },
        })
    }
}

impl CubeModel {
    /// The answer of resolvent walks.
    pub(super) fn resolvent_in<F: CubeScalar, const D: usize>(
        &self,
        question: &ResolventQuestion<'_>,
    ) -> Result<ResolventAnswer, Error> {
        let [kernel, _, source] = self.functions.seconds();
        // K(x, x) is looked at, and may have no value.
        let mut edges = Vec::new();
        watch::<F>(&*self.functions, &mut |values| {
            if let Ok(cube) = values.cube::<D>(1) {
                edges = resolvent::edges(&ByDensity(cube));
            }
        });
        with_values::<F, _>(&*self.functions, |values| {
            let whole = || Ok::<_, Error>(ByDensity(values.cube::<D>(1)?));
            let least = edges.iter().map(|inner| inner.len() + 1).max();
            let all = |cells: usize| [cells, cells.saturating_pow(D as u32)];
            let sizes = ResolventSizes {
                levels: match question.settings.cells {
                    Some(cells) => vec![all(cells)],
                    None => {
                        let least = least.unwrap_or(1);
                        let more = LEVELS.into_iter().filter(|&cells| cells > least);
                        core::iter::once(least).chain(more).map(all).collect()
                    }
                },
                dimension: D,
                seconds: [kernel, source],
            };
            let answer = resolvent::answer(question, &sizes, &|cells, degree| {
                resolvent::cut_of(Grid::new(whole()?, &edges, cells), values, degree)
            });
            // It says where a value was no number.
            values.check()?;
            answer
        })
    }
}
