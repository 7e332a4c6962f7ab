//! The numbers of a picture from a global estimate: every pixel and every stretch of wall from one set of walks.

use web_time::Instant;

use fredholm_core::Located;
use fredholm_core::galerkin::{Cells as _, legendre};
use fredholm_core::global::over_replicates;
use fredholm_model::channels::refuse_whole;
use fredholm_model::{
    Discretisation, Error, GlobalQuantity, GlobalRequest, GlobalSystem, IMAGE_HEAD, Subject,
    picture_is_biased,
};
use fredholm_rayon::{Observer, Replicates, fill_rows};
use fredholm_room::{Enclosure, Seen};

use super::{MOST_DEGREE, RoomField};
use crate::RoomModel;
use crate::field::{Field, FieldRequest, is_inside};
use fredholm_model::{BLANK, Spot};

/// Replicates: an error bar of 16 is uncertain by 18 %, which no colour tells.
const REPLICATES: usize = 16;
/// The parts in which walks are made, as often as a cancellation is looked for.
const ROUNDS: u64 = 16;
/// The width of a panel of directions in radians. Three Gauss points leave some 10⁻⁵ of u where it is smooth along a wall.
const PANEL: f64 = 0.15;
/// The whole weight of a panel over that of the second of its three Gauss points. Error bars of pixels take that point alone: T_K ê is as smooth as
/// u there, and their 16 replicates know them to a fifth.
const OF_MIDDLE: f64 = 18.0 / 8.0;
/// Pixels that one thread makes in one go.
const ROW: usize = 64;

impl RoomModel {
    /// The numbers of a picture from so many walks for all of it, with their standard errors: what every position sees is an
    /// integral of u = F + T_K v + T_K ê over the visible parts of walls, by three Gauss points in panels of directions, and
    /// the edges of shadows in the air are exact. `walking` is called when walks begin.
    ///
    /// # Errors
    /// [`Error`]; [`Error::Cancelled`].
    pub fn whole_field(
        &self,
        discretisation: &Discretisation,
        request: &FieldRequest<'_>,
        watch: &dyn Observer,
        walking: &dyn Fn(),
    ) -> Result<Field, Error> {
        let start = Instant::now();
        refuse_whole(self)?;
        if discretisation.degree >= MOST_DEGREE {
            return Err(Error::Option {
                subject: Subject::Degree,
                message: format!(
                    "walks of a global estimate score on polynomials of a higher degree than v: use a `degree` of at most {}",
                    MOST_DEGREE - 1
                ),
            });
        }
        let system = self.cut(discretisation)?.system()?;
        let whole = GlobalRequest {
            walk: request.walk,
            degree: system.default_degree(),
            knows_first: true,
        };
        walking();
        let mut rows = Vec::new();
        let mut walked = 0;
        system.walks(&whole, &mut |job| {
            let mut replicates = Replicates::new(job, REPLICATES);
            let each = request.walk.walks.div_ceil(REPLICATES as u64 * ROUNDS);
            for _ in 0..ROUNDS {
                replicates.run(job, each.max(1), watch)?;
                if watch.cancelled() {
                    return Err(Error::Cancelled);
                }
            }
            let counts = replicates.counts();
            if counts.step_limit > 0 {
                return Err(picture_is_biased());
            }
            walked = counts.walks;
            rows = replicates.coefficients(job, &|cell| system.measure(cell));
            Ok(())
        })?;
        let field = system.room_field(&whole, rows)?;
        let closed = self.scene.enclosure() == Enclosure::Closed;
        let (air, walls) = field.picture(request, closed, watch)?;
        Ok(Field {
            air,
            walls,
            channels: [Vec::new(), Vec::new()],
            walks: walked,
            seconds: start.elapsed().as_secs_f64(),
        })
    }
}

impl RoomField<'_> {
    fn picture(
        &self,
        request: &FieldRequest<'_>,
        closed: bool,
        watch: &dyn Observer,
    ) -> Result<(Vec<Spot>, Vec<Spot>), Error> {
        let room = self.tables.room();
        let table = self.by_function(self.lifted(&room)?);
        let rows = REPLICATES + 1;
        let at = |position: [f64; 2]| {
            let position = self.cut.model.folded(position);
            let (mut share, mut value, mut replicates) = (0.0, 0.0, [0.0; REPLICATES]);
            let mut is_middle = [false, true, false].into_iter().cycle();
            let seen = Seen {
                room: &room,
                position,
            };
            seen.points(PANEL, |point, weight| {
                share += weight;
                let cell = room.locate(&point);
                let mut place = [0.0];
                room.parameters(&Located { point, cell }, &mut place);
                let psi: [f64; MOST_DEGREE + 1] = legendre(2.0 * place[0] - 1.0);
                let own = table.get(cell * self.functions * rows..);
                let own = own.unwrap_or_default().chunks_exact(rows);
                let scored = is_middle.next().unwrap_or(false);
                for (row, function) in own.zip(psi).take(self.functions) {
                    let Some((first, row)) = row.split_first() else {
                        return;
                    };
                    value += weight * function * first;
                    if scored {
                        let factor = OF_MIDDLE * weight * function;
                        for (sum, coefficient) in replicates.iter_mut().zip(row) {
                            *sum += factor * coefficient;
                        }
                    }
                }
            });
            if is_inside(share, closed, f64::EPSILON) {
                Spot {
                    value: value + seen.sky(),
                    error: over_replicates(&replicates).std_error,
                }
            } else {
                BLANK
            }
        };
        let mut air = vec![BLANK; request.positions.len()];
        fill_rows(&mut air, ROW, |row, spots| {
            let positions = request.positions.iter().skip(row * ROW);
            for (spot, position) in spots.iter_mut().zip(positions) {
                *spot = at(*position);
            }
            if watch.cancelled() {
                return Err(Error::Cancelled);
            }
            Ok(())
        })?;
        let mut walls = vec![BLANK; request.stretches.len()];
        fill_rows(&mut walls, 1, |number, spots| {
            let stretch = request.stretches[number];
            let x = room.on_wall(stretch.wall, stretch.middle)?;
            let mut moments = vec![0.0; self.unknowns()];
            self.irradiance(&room, &x, &mut moments);
            let mut image = vec![0.0; IMAGE_HEAD + REPLICATES];
            let terms = self.terms_at(GlobalQuantity::U, &room, &x)?;
            self.contract(terms, &moments, &self.rows, &mut image);
            spots[0] = spot(image[0], &image[IMAGE_HEAD..]);
            Ok::<(), Error>(())
        })?;
        Ok((air, walls))
    }

    /// Rows of coefficients, turned so that those of one function of one cell stand side by side, and the mean of replicates added to
    /// the first.
    fn by_function(&self, rows: &[f64]) -> Vec<f64> {
        let count = rows.len() / self.unknowns();
        let mut turned = vec![0.0; rows.len()];
        for (row, coefficients) in rows.chunks_exact(self.unknowns()).enumerate() {
            let places = turned.iter_mut().skip(row).step_by(count);
            for (place, coefficient) in places.zip(coefficients) {
                *place = *coefficient;
            }
        }
        for own in turned.chunks_exact_mut(count) {
            if let Some((first, replicates)) = own.split_first_mut() {
                *first += replicates.iter().sum::<f64>() / replicates.len() as f64;
            }
        }
        turned
    }
}

/// The deterministic part and what replicates add.
fn spot(iterate: f64, replicates: &[f64]) -> Spot {
    let correction = over_replicates(replicates);
    Spot {
        value: iterate + correction.mean,
        error: correction.std_error,
    }
}
