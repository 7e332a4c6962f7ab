//! Coefficients and Galerkin solution of a cube: compiled once for all degrees.

use std::borrow::Cow;

use fredholm_core::galerkin::{Solution, buffer};
use fredholm_cube::ProductTables;
use fredholm_model::{Error, Partitioned as _, SavedSystem, System};

use super::degree::AnyDegree;
use super::functions::{Watched, Which, with_values};
use super::system::{CubeSystem, Solved};
use super::table::{Table, fill};
use super::{CubePartition, SWEEPS, TOLERANCE, integral};

impl<'m> CubePartition<'m> {
    /// The coefficients and the Galerkin solution, on all threads.
    pub(super) fn solve_in<const D: usize>(
        &self,
        degree: &'static dyn AnyDegree<D>,
    ) -> Result<Box<dyn System + 'm>, Error> {
        let solved = with_values::<f64, _>(self.functions(), |values| {
            if self.functions().has_integral() {
                integral::check(self.functions(), values)?;
            }
            self.solved(values)
        })?;
        Ok(self.system(degree, solved))
    }

    fn system<const D: usize>(
        &self,
        degree: &'static dyn AnyDegree<D>,
        solved: Solved<'m, D>,
    ) -> Box<dyn System + 'm> {
        Box::new(CubeSystem::<'m, D> {
            cut: *self,
            solved,
            degree,
            lifted: None,
        })
    }

    fn solved<const D: usize>(&self, values: &Watched<'_, f64>) -> Result<Solved<'m, D>, Error> {
        let (rule, kernel) = (self.rule::<D>(values)?, values.kernel());
        let entries = if self.functions().is_product() {
            rule.product_tables(&kernel)?.entries().to_vec()
        } else {
            let unknowns = rule.unknowns();
            let mut entries = buffer(unknowns.saturating_mul(unknowns))?;
            let rows = |i, rows: &mut [f64]| {
                if self.has_integrals() {
                    self.fill_by_integral(&kernel, i, rows);
                    return Ok(());
                }
                rule.fill_row(&kernel, i, rows)
            };
            fill(&mut entries, unknowns * rule.functions(), &rows)?;
            entries
        };
        let table = self.table_of::<D>(entries.into())?;
        let source = rule.means(&values.function(Which::Source))?;
        let solution = Solution::new(&table, source, TOLERANCE, SWEEPS)?;
        Ok(Solved { table, solution })
    }

    /// The system of coefficients that were computed before.
    pub(super) fn restore_in<const D: usize>(
        &self,
        degree: &'static dyn AnyDegree<D>,
        saved: SavedSystem<'m>,
    ) -> Result<Box<dyn System + 'm>, Error> {
        let solution = saved.fitting(self.unknowns(), self.coefficients(), Some(0))?;
        let table = self.table_of(saved.coefficients)?;
        Ok(self.system(degree, Solved { table, solution }))
    }

    /// The number of coefficients that a table has, if it can be had.
    fn coefficients(&self) -> Option<usize> {
        if !self.functions().is_product() {
            return self.unknowns().checked_mul(self.unknowns());
        }
        let width = self.per_axis.checked_mul(self.degree + 1)?;
        width.checked_mul(width)?.checked_mul(self.model.dimension)
    }

    fn table_of<'a, const D: usize>(&self, entries: Cow<'a, [f64]>) -> Result<Table<'a, D>, Error> {
        Ok(if self.functions().is_product() {
            Table::Product(ProductTables::new(self.per_axis, self.degree, entries)?)
        } else {
            Table::Dense {
                entries,
                cells: self.all_cells(),
                functions: self.functions_on_cell(),
            }
        })
    }
}
