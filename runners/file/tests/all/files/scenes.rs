//! Files of scenes.

use super::*;

/// The scenes of the project can be solved.
#[test]
fn examples() {
    let folder = concat!(env!("CARGO_MANIFEST_DIR"), "/../../examples/");
    for (name, faces) in [
        // Floors below blocks are cut away.
        ("cornell", 28),
        ("living-room", 522),
        ("living-room-daylight", 521),
        ("reheating", 18),
        ("satellite", 10),
    ] {
        let path = format!("{folder}{name}.toml");
        let text = std::fs::read_to_string(&path).unwrap();
        let resolved = read(&path, &text).unwrap().resolve().unwrap();
        let Resolution::Scene(scene) = &resolved.model else {
            panic!("{name} is a scene");
        };
        assert_eq!(scene.scene().faces().len(), faces, "{name}");
    }
}
