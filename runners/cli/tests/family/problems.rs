//! Random problems: a grammar of kernels and sources, circles and rooms, errors from coarse to fine.

use fredholm::Tolerance;

/// Numbers that look random: splitmix64.
pub(crate) struct Random(pub(crate) u64);

impl Random {
    fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    fn between(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * (self.next() >> 11) as f64 / (1_u64 << 53) as f64
    }

    fn of<T: Copy>(&mut self, all: &[T]) -> T {
        all[(self.next() % all.len() as u64) as usize]
    }
}

/// A problem with an error and nothing else.
pub(crate) struct Problem {
    /// What it is, for people.
    pub(crate) name: String,
    /// The file without an error.
    pub(crate) text: String,
    /// The standard error that is asked for, perhaps in multiples of u.
    pub(crate) error: f64,
    /// Whether it is in multiples of u.
    pub(crate) relative: bool,
    /// Seconds that the best of the ladder may take: the error of a problem that takes longer is made larger.
    pub(crate) most_seconds: f64,
    /// Cells of the ladder, by day without the last.
    pub(crate) cells: &'static [usize],
}

impl Problem {
    /// The next problem.
    pub(crate) fn new(random: &mut Random, number: u64, long: bool) -> Self {
        let least = if long { -10.0 } else { -6.0 };
        let error = 10_f64.powf(random.between(least, MOST_ERROR.log10()));
        let relative = random.next().is_multiple_of(2);
        let (name, text, cells, at) = match random.next() % 5 {
            0 => circle(random),
            1 => room(random),
            _ => cube(random),
        };
        let (more, text) = with_more_targets(text, number, at);
        Self {
            name: format!("{name}, {} targets", 1 + more),
            text,
            error,
            relative,
            most_seconds: most_seconds(number),
            cells: &cells[..if long { 3 } else { 2 }],
        }
    }

    /// A standard error as the problem asks for it.
    pub(crate) fn tolerance(&self, error: f64) -> Tolerance {
        if self.relative {
            Tolerance::Relative(error)
        } else {
            Tolerance::Absolute(error)
        }
    }
}

/// The largest error, to which no other one is made larger: with many targets the least number of walks takes a second.
pub(crate) const MOST_ERROR: f64 = 1e-2;

/// The name, the file, the cells of the ladder, and a target at a place from 0 to 1.
type Drawn = (String, String, Cells, fn(f64) -> String);
type Cells = &'static [usize];

/// From a fifth of a second to twenty, of a stream of their own: all problems together take half an hour, and some of them
/// are long.
fn most_seconds(number: u64) -> f64 {
    20.0 * 10_f64.powf(Random(!number).between(-2.0, 0.0))
}

/// One problem in four has 1 to 49 targets more, whose places are of a stream of their own.
fn with_more_targets(text: String, number: u64, at: fn(f64) -> String) -> (usize, String) {
    const EACH: u64 = 4;
    if number % EACH != EACH - 1 {
        return (0, text);
    }
    let mut random = Random(number);
    let more = 1 + random.next() as usize % 49;
    let target = |i| {
        format!(
            ", {{ name = \"t{i}\", at = {} }}",
            at(random.between(0.0, 1.0))
        )
    };
    let targets: String = (0..more).map(target).collect();
    let before = text.strip_suffix("]\n").expect("targets are last");
    (more, format!("{before}{targets}]\n"))
}

/// A kernel of one axis with a parameter.
type Axis = (&'static str, fn(f64, f64, f64) -> f64);

const AXES: [Axis; 5] = [
    ("exp(-A*(X-Y)^2)", |a, x, y| (-a * (x - y).powi(2)).exp()),
    ("1/(1+A*(X-Y)^2)", |a, x, y| {
        1.0 / (1.0 + a * (x - y).powi(2))
    }),
    ("cos(A*(X-Y))", |a, x, y| (a * (x - y)).cos()),
    ("exp(A*X*Y)", |a, x, y| (a * x * y).exp()),
    ("(1+A*X)/(1+Y)", |a, x, y| (1.0 + a * x) / (1.0 + y)),
];
const SOURCES: [&str; 6] = [
    "1",
    "1+x1",
    "x1-0.4",
    "cos(7*x1)",
    "x1 < 0.37 ? 1 : 0",
    "sqrt(abs(x1-0.3))",
];

/// The spectral radius of the square of a kernel of one axis, by the powers of a matrix of its midpoints.
fn radius_of_square(kernel: impl Fn(f64, f64) -> f64) -> f64 {
    const N: usize = 80;
    let at = |i: usize| (i as f64 + 0.5) / N as f64;
    let mut v = vec![1.0; N];
    let mut largest = 0.0;
    for _ in 0..60 {
        let row = |i| {
            (0..N)
                .map(|j| kernel(at(i), at(j)).powi(2) * v[j])
                .sum::<f64>()
                / N as f64
        };
        let w: Vec<f64> = (0..N).map(row).collect();
        largest = w.iter().copied().fold(0.0, f64::max);
        v = w.iter().map(|w| w / largest).collect();
    }
    largest
}

fn cube(random: &mut Random) -> Drawn {
    let dimension = random.of(&[1_usize, 1, 1, 2, 2, 3]);
    let (axis, kernel) = random.of(&AXES);
    let parameter = 2_f64.powf(random.between(-1.0, 4.0));
    let parameter = if axis.contains("exp(A") {
        1.0
    } else {
        parameter
    };
    let share = random.between(0.33, 0.99);
    let radius = radius_of_square(|x, y| kernel(parameter, x, y)).powi(dimension as i32);
    let constant = share / radius.sqrt();
    let factor = |i: usize| {
        let axis = axis.replace('A', &parameter.to_string());
        axis.replace('X', &format!("x{i}"))
            .replace('Y', &format!("y{i}"))
    };
    let factors: Vec<String> = (1..=dimension)
        .map(|i| format!("({})", factor(i)))
        .collect();
    let mut source = random.of(&SOURCES).to_owned();
    let mut formula = format!("{constant}*{}", factors.join("*"));
    if dimension == 1 {
        source = source.replace("x1", "x");
        formula = formula.replace("x1", "x").replace("y1", "y");
    }
    let at = vec![format!("{:.3}", random.between(0.0, 1.0)); dimension].join(", ");
    let target = random.of(&["over = \"all\"", ""]);
    let target = match (target, dimension) {
        ("", 1) => format!("at = {at}"),
        ("", _) => format!("at = [{at}]"),
        (target, _) => target.to_owned(),
    };
    let text = format!(
        "problem = {{ kind = \"cube\", dimension = {dimension}, kernel = \"{formula}\", source = \"{source}\" }}\n\
         target = [{{ name = \"t\", {target} }}]\n"
    );
    let (cells, at): (Cells, fn(f64) -> String) = match dimension {
        1 => (&[4, 12, 48], |x| format!("{x:.3}")),
        2 => (&[2, 4, 8], |x| format!("[{x:.3}, 0.3]")),
        _ => (&[1, 2, 3], |x| format!("[{x:.3}, 0.3, 0.6]")),
    };
    let name = format!("d = {dimension}, {axis} with {parameter:.2}, {share:.2}, {source}");
    (name, text, cells, at)
}

fn circle(random: &mut Random) -> Drawn {
    let arcs = random.of(&[2, 5, 12]);
    let most = random.between(0.3, 0.99);
    let mut arc = || format!("{:.4}", random.between(0.0, most));
    let mut reflectance: Vec<String> = (1..arcs).map(|_| arc()).collect();
    reflectance.push(format!("{most:.4}"));
    let amplitude = random.of(&["0.0", "1.0", "4.9"]);
    let frequency = random.of(&["1", "5"]);
    let text = format!(
        "problem = {{ kind = \"circle\", reflectance = [{}], emission = {{ constant = 5.0, amplitude = {amplitude}, \
         frequency = {frequency} }} }}\ntarget = [{{ name = \"t\", at = {:.3} }}]\n",
        reflectance.join(", "),
        random.between(0.0, core::f64::consts::TAU),
    );
    let name = format!("circle, {arcs} arcs up to {most:.2}, amplitude {amplitude}");
    (name, text, &[60, 120, 480], |x| {
        format!("{:.3}", core::f64::consts::TAU * x)
    })
}

fn room(random: &mut Random) -> Drawn {
    let most = random.between(0.3, 0.99);
    let (width, height) = (random.between(1.0, 4.0), random.between(1.0, 4.0));
    let notch = random.next().is_multiple_of(2);
    let (w, h) = (0.5 * width, 0.6 * height);
    let mut corners = vec![[0.0, 0.0], [width, 0.0], [width, height]];
    if notch {
        corners.extend([[w, height], [w, h], [0.0, h]]);
    } else {
        corners.push([0.0, height]);
    }
    let lamp = random.next() as usize % corners.len();
    let mut surfaces = Vec::new();
    for (i, [x, y]) in corners.iter().enumerate() {
        let [to_x, to_y] = corners[(i + 1) % corners.len()];
        let reflectance = if i == 0 {
            most
        } else {
            random.between(0.0, most)
        };
        let emission = if i == lamp { ", emission = 1" } else { "" };
        surfaces.push(format!(
            "{{ name = \"s{i}\", points = [[{x:.4}, {y:.4}], [{to_x:.4}, {to_y:.4}]], reflectance = {reflectance:.4}{emission} }}"
        ));
    }
    let target = random.of(&["at = { surface = \"s0\", t = 0.37 }", "over = \"all\""]);
    let text = format!(
        "problem.kind = \"room\"\nproblem.surface = [{}]\ntarget = [{{ name = \"t\", {target} }}]\n",
        surfaces.join(", ")
    );
    let name = format!("room of {} walls up to {most:.2}", corners.len());
    (name, text, &[25, 100, 200], |x| {
        format!("{{ surface = \"s0\", t = {:.3} }}", 0.05 + 0.9 * x)
    })
}
