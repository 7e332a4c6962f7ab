//! The examples of the project's README and manual are compiled and run.

#[doc = include_str!("../../../README.md")]
struct Readme;
#[doc = include_str!("../../../docs/fit.md")]
struct Fit;
#[doc = include_str!("../../../docs/certify.md")]
struct Certify;
#[doc = include_str!("../../../docs/circles.md")]
struct Circles;
#[doc = include_str!("../../../docs/cubes.md")]
struct Cubes;
#[doc = include_str!("../../../docs/global.md")]
struct Global;
#[doc = include_str!("../../../docs/method-2-neighbour.md")]
struct Method2Neighbour;
#[doc = include_str!("../../../docs/own-equation.md")]
struct OwnEquation;
#[doc = include_str!("../../../docs/report.md")]
struct Report;
#[doc = include_str!("../../../docs/rooms.md")]
struct Rooms;
#[doc = include_str!("../../../docs/sensitivities.md")]
struct Sensitivities;
#[doc = include_str!("../../../docs/sequences.md")]
struct Sequences;
#[doc = include_str!("../../../docs/spheres.md")]
struct Spheres;
#[doc = include_str!("../../../docs/start.md")]
struct Start;
