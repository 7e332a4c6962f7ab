//! Coefficients and Galerkin solution of a cube: compiled once for all degrees.

use std::borrow::Cow;

use fredholm_cube::{CellFunctions, CubeSetup, empty_table};
use fredholm_model::{Error, Partitioned as _, SavedSystem, System};

use super::degree::AnyDegree;
use super::functions::{Watched, with_values};
use super::system::{CubeSystem, Solved};
use super::table::{Table, fill};
use super::{CubePartition, SWEEPS, TOLERANCE, integral};

/// A q0 for what does not depend on it.
pub(super) const ANY: f64 = 0.5;

impl<'m> CubePartition<'m> {
    /// The coefficients and the Galerkin solution, on all threads.
    pub(super) fn solve_in<const D: usize>(
        &self,
        degree: &'static dyn AnyDegree<D>,
        absorption: f64,
    ) -> Result<Box<dyn System + 'm>, Error> {
        let solved = with_values::<f64, _>(self.functions(), |values| {
            if self.functions().has_integral() {
                integral::check(self.functions(), values)?;
            }
            self.solved(values, degree.functions(), absorption)
        })?;
        Ok(Box::new(CubeSystem::<'m, D> {
            cut: *self,
            solved,
            degree,
            lifted: None,
        }))
    }

    fn solved<const D: usize>(
        &self,
        values: &Watched<'_, f64>,
        functions: CellFunctions<D>,
        absorption: f64,
    ) -> Result<Solved<'m, D>, Error> {
        let rule = self.rule()?;
        let cube = values.cube::<D>(self.per_axis, absorption)?;
        let setup = CubeSetup::new(&cube, functions);
        let kernel = values.kernel();
        if let Some(stages) = self.model.stages {
            let source = setup.source_means(rule)?;
            return self.staged(values, (&source, stages), absorption);
        }
        let table = if self.functions().is_product() {
            Table::Product(setup.product_tables(&kernel, rule)?)
        } else {
            let unknowns = setup.unknowns();
            let mut entries = empty_table(unknowns)?;
            let rows = |i, rows: &mut [f64]| {
                if self.has_integrals() {
                    self.fill_by_integral(&kernel, i, rows);
                    return Ok(());
                }
                CubeSetup::new(&cube, functions).fill_row(rule, i, rows)
            };
            fill(&mut entries, unknowns * functions.count(), &rows)?;
            Table::Dense {
                entries: entries.into(),
                cells: setup.cells(),
                functions: functions.count(),
            }
        };
        let solution = setup.solve(&table, rule, TOLERANCE, SWEEPS)?;
        Ok(Solved { table, solution })
    }

    /// The system of coefficients that were computed before.
    pub(super) fn restore_in<const D: usize>(
        &self,
        degree: &'static dyn AnyDegree<D>,
        saved: SavedSystem<'m>,
    ) -> Result<Box<dyn System + 'm>, Error> {
        let solution = saved.fitting(self.unknowns(), self.coefficients(), Some(0))?;
        let table = with_values::<f64, _>(self.functions(), |values| {
            self.table_of(values, degree.functions(), saved.coefficients)
        })?;
        Ok(Box::new(CubeSystem::<'m, D> {
            cut: *self,
            solved: Solved { table, solution },
            degree,
            lifted: None,
        }))
    }

    /// The number of coefficients that a table has, if it can be had.
    fn coefficients(&self) -> Option<usize> {
        if !self.functions().is_product() {
            return self.unknowns().checked_mul(self.unknowns());
        }
        let width = self.per_axis.checked_mul(self.degree + 1)?;
        width.checked_mul(width)?.checked_mul(self.model.dimension)
    }

    fn table_of<'a, const D: usize>(
        &self,
        values: &Watched<'_, f64>,
        functions: CellFunctions<D>,
        entries: Cow<'a, [f64]>,
    ) -> Result<Table<'a, D>, Error> {
        let cube = values.cube::<D>(self.per_axis, ANY)?;
        let setup = CubeSetup::new(&cube, functions);
        if self.functions().is_product() {
            let tables = setup.product_tables_of(entries.into_owned())?;
            return Ok(Table::Product(tables));
        }
        Ok(Table::Dense {
            entries,
            cells: setup.cells(),
            functions: functions.count(),
        })
    }
}
