// Written by `fredholm export` from circle_cubic_f32.toml (a circle). Include it within a module of its own:
// mod tables { include!("…"); }
pub(crate) static CIRCLE: [fredholm_circle::Constants<f32>; 1] = [
    fredholm_circle::Constants::new([0.2, 0.07841371, 1.25, 0.8, 0.9951847, 0.0048152735, 0.09785976, 0.0064131487]),
];
pub(crate) static HARMONIC: [f64; 3] = [5.0, 1.0, 5.0];
pub(crate) static CELLS: [fredholm_circle::Cell<f32>; 16] = [
    fredholm_circle::Cell::new([0.9951847, 0.09801714, 7.109666e-9, -8.933932e-10, 0.3]),
    fredholm_circle::Cell::new([0.95694035, 0.29028466, -1.7184508e-8, 1.3815665e-8, 0.3]),
    fredholm_circle::Cell::new([0.8819213, 0.47139674, -2.7002963e-8, -7.4252537e-9, 0.3]),
    fredholm_circle::Cell::new([0.77301043, 0.6343933, 2.0642553e-8, 9.379558e-9, 0.3]),
    fredholm_circle::Cell::new([0.6343933, 0.77301043, 9.379558e-9, 2.0642553e-8, 0.3]),
    fredholm_circle::Cell::new([0.47139674, 0.8819213, -7.4252537e-9, -2.7002963e-8, 0.3]),
    fredholm_circle::Cell::new([0.29028466, 0.95694035, 1.3815665e-8, -1.7184508e-8, 0.3]),
    fredholm_circle::Cell::new([0.09801714, 0.9951847, -8.933932e-10, 7.109666e-9, 0.3]),
    fredholm_circle::Cell::new([-0.09801714, 0.9951847, 8.933932e-10, 7.109666e-9, 0.7]),
    fredholm_circle::Cell::new([-0.29028466, 0.95694035, -1.3815665e-8, -1.7184508e-8, 0.7]),
    fredholm_circle::Cell::new([-0.47139674, 0.8819213, 7.4252537e-9, -2.7002963e-8, 0.7]),
    fredholm_circle::Cell::new([-0.6343933, 0.77301043, -9.379558e-9, 2.0642553e-8, 0.7]),
    fredholm_circle::Cell::new([-0.77301043, 0.6343933, -2.0642553e-8, 9.379558e-9, 0.7]),
    fredholm_circle::Cell::new([-0.8819213, 0.47139674, 2.7002963e-8, -7.4252537e-9, 0.7]),
    fredholm_circle::Cell::new([-0.95694035, 0.29028466, 1.7184508e-8, 1.3815665e-8, 0.7]),
    fredholm_circle::Cell::new([-0.9951847, 0.09801714, -7.109666e-9, -8.933932e-10, 0.7]),
];
pub(crate) static SLOTS: [fredholm_circle::Slot<f32>; 32] = [
    fredholm_circle::Slot::new(0.08295534, 0), fredholm_circle::Slot::new(0.08295534, 0),
    fredholm_circle::Slot::new(0.08295534, 0), fredholm_circle::Slot::new(0.14644662, 1),
    fredholm_circle::Slot::new(0.14644662, 1), fredholm_circle::Slot::new(0.2002719, 2),
    fredholm_circle::Slot::new(0.2002719, 2), fredholm_circle::Slot::new(0.25, 3),
    fredholm_circle::Slot::new(0.2997281, 4), fredholm_circle::Slot::new(0.2997281, 4),
    fredholm_circle::Slot::new(0.35355338, 5), fredholm_circle::Slot::new(0.35355338, 5),
    fredholm_circle::Slot::new(0.41704467, 6), fredholm_circle::Slot::new(0.41704467, 6),
    fredholm_circle::Slot::new(0.5, 7), fredholm_circle::Slot::new(0.5, 7),
    fredholm_circle::Slot::new(0.58295536, 8), fredholm_circle::Slot::new(0.58295536, 8),
    fredholm_circle::Slot::new(0.58295536, 8), fredholm_circle::Slot::new(0.6464466, 9),
    fredholm_circle::Slot::new(0.6464466, 9), fredholm_circle::Slot::new(0.7002719, 10),
    fredholm_circle::Slot::new(0.7002719, 10), fredholm_circle::Slot::new(0.75, 11),
    fredholm_circle::Slot::new(0.7997281, 12), fredholm_circle::Slot::new(0.7997281, 12),
    fredholm_circle::Slot::new(0.8535534, 13), fredholm_circle::Slot::new(0.8535534, 13),
    fredholm_circle::Slot::new(0.91704464, 14), fredholm_circle::Slot::new(0.91704464, 14),
    fredholm_circle::Slot::new(2.0, 15), fredholm_circle::Slot::new(2.0, 15),
];
pub(crate) static DEGREE: [u32; 1] = [3];
pub(crate) static V: [f32; 64] = [
    5.704195, 0.28557903, -0.1114574, -0.012552475, 5.1652274, -0.5041517, -0.0261516, 0.022159724,
    4.1693454, 0.10028201, 0.13147298, -0.004407843, 5.470528, 0.4273992, -0.074473456,
    -0.018786106, 5.470528, -0.4273992, -0.074473456, 0.018786106, 4.1693454, -0.10028201,
    0.13147298, 0.004407843, 5.1652274, 0.5041517, -0.0261516, -0.022159724, 5.704195, -0.28557903,
    -0.1114574, 0.012552475, 4.295805, -0.28557903, 0.111457594, 0.012552483, 4.8347726, 0.5041517,
    0.026151644, -0.022159737, 5.8306546, -0.10028201, -0.1314732, 0.004407846, 4.529472,
    -0.4273992, 0.07447358, 0.018786117, 4.529472, 0.4273992, 0.07447358, -0.018786117, 5.8306546,
    0.10028201, -0.1314732, -0.004407846, 4.8347726, -0.5041517, 0.026151644, 0.022159737, 4.295805,
    0.28557903, 0.111457594, -0.012552483,
];
pub(crate) static SOURCE: [f32; 64] = [
    4.2172556, 0.2861139, -0.10931902, -0.0125527, 3.6756544, -0.50509596, -0.024009429, 0.02216012,
    2.6749063, 0.100469835, 0.13362214, -0.0044079223, 3.9824471, 0.42819968, -0.07233343,
    -0.018786443, 3.9824471, -0.42819968, -0.07233343, 0.018786443, 2.6749063, -0.100469835,
    0.13362214, 0.0044079223, 3.6756544, 0.50509596, -0.024009429, -0.02216012, 4.2172556,
    -0.2861139, -0.10931902, 0.0125527, 0.810222, -0.28682703, 0.11647025, 0.012553008, 1.3553348,
    0.5063549, 0.031155461, -0.022160664, 2.3625715, -0.10072026, -0.1264857, 0.0044080303,
    1.0465531, -0.429267, 0.07948241, 0.018786903, 1.0465531, 0.429267, 0.07948241, -0.018786903,
    2.3625715, 0.10072026, -0.1264857, -0.0044080303, 1.3553348, -0.5063549, 0.031155461,
    0.022160664, 0.810222, 0.28682703, 0.11647025, -0.012553008,
];
pub(crate) static PAIRS: [u32; 1] = [1];
