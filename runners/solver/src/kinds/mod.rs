//! The kinds of equations that follow from what a problem states.

/// Makes a type around a [`CustomModel`](crate::CustomModel) a model: its walks and set-ups are compiled in this crate, with this crate's
/// optimisation, and not once more wherever such a model is used.
macro_rules! compiled_here {
    ($model:ty) => {
        impl Model for $model {
            fn about(&self) -> About {
                self.0.about()
            }

            fn check_goals(&self, goals: &[Goal]) -> Result<(), Error> {
                self.0.check_goals(goals)
            }

            fn place(&self, region: &Region) -> Option<[f64; 3]> {
                self.0.place(region)
            }

            fn around(&self) -> Option<[f64; 2]> {
                self.0.around()
            }

            fn last_steps(&self) -> LastSteps {
                self.0.last_steps()
            }

            fn by_resolvent(
                &self,
                question: &ResolventQuestion<'_>,
            ) -> Result<ResolventAnswer, Error> {
                self.0.by_resolvent(question)
            }

            fn grid(&self, points: usize, part: Option<usize>) -> Vec<Region> {
                self.0.grid(points, part)
            }

            fn spread(&self, points: f64) -> Vec<Region> {
                self.0.spread(points)
            }

            fn has_whole(&self) -> bool {
                self.0.has_whole()
            }

            fn has_sequences(&self) -> bool {
                self.0.has_sequences()
            }

            fn most_lift(&self) -> usize {
                self.0.most_lift()
            }

            fn exact(&self, region: &Region) -> Result<Option<f64>, Error> {
                self.0.exact(region)
            }

            fn check(&self, discretisation: &Discretisation, pairs: Pairs) -> Result<(), Error> {
                self.0.check(discretisation, pairs)
            }

            fn partition<'m>(
                &'m self,
                discretisation: &Discretisation,
            ) -> Result<Box<dyn Partitioned<'m> + 'm>, Error> {
                self.0.partition(discretisation)
            }

            fn levels(&self, discretisation: &Discretisation) -> Vec<usize> {
                self.0.levels(discretisation)
            }

            fn smooth_order(&self, degree: usize) -> f64 {
                self.0.smooth_order(degree)
            }
        }
    };
}

pub mod circle;
pub mod sphere;
