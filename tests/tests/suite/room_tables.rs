//! Tables of a room: those that do not belong together.

use fredholm_room::{
    Edge, Geometry, Node, Partition, PartitionTables, Room, RoomError, Strip, Wall,
};

#[test]
fn tables_that_do_not_belong_together() {
    let wall = Wall {
        ends: [[0.0, 0.0], [1.0, 0.0]],
        vertices: [0, 1],
        tangent: [1.0, 0.0],
        length: 1.0,
        reflectance: 0.5,
        emission: 0.0,
    };
    let strip = |wall_number| Strip {
        places: [[0.0, 1.0, 1.0, 1.0], [0.0; 4]],
        vertices: [0, 1, 1, 1],
        walls: [wall_number, u32::MAX, u32::MAX, u32::MAX],
    };
    let node = |first, count| Node {
        centre: [0.5, 0.0],
        half: [0.6, 0.1],
        first,
        count,
        links: [u32::from(count > 0), 0],
    };
    let geometry = |wall_number, nodes: &[Node<f64>]| {
        Geometry::new(&[wall], &[strip(wall_number)], nodes, true).err()
    };
    let bad = Some(RoomError::Tables);
    assert_eq!(geometry(0, &[node(0, 1)]), None);
    assert_eq!(geometry(0, &[node(1, 0), node(0, 1), node(0, 1)]), None);
    assert_eq!(geometry(1, &[node(0, 1)]), bad);
    assert_eq!(geometry(0, &[node(0, 2)]), bad);
    assert_eq!(geometry(0, &[node(1, 1)]), bad);
    assert_eq!(geometry(0, &[]), bad);
    // Bits of walls that are not there, of none, and a wall that leads out of its leaf.
    let bits = |links| Node {
        links,
        ..node(0, 1)
    };
    assert_eq!(geometry(0, &[bits([3, 0])]), bad);
    assert_eq!(geometry(0, &[bits([0; 2])]), bad);
    let out = Strip {
        vertices: [1, 1, 1, 0],
        places: [[1.0, 1.0, 1.0, 0.0], [0.0; 4]],
        walls: [u32::MAX, u32::MAX, u32::MAX, 0],
    };
    let leads_out = [Node {
        links: [0, 1 << 16],
        ..node(0, 1)
    }];
    assert_eq!(
        Geometry::new(&[wall], &[out, strip(u32::MAX)], &leads_out, true).err(),
        bad
    );
    // No materials, and a strip that is not its wall's.
    let changed = |change: fn(&mut Wall<f64>)| {
        let mut other = wall;
        change(&mut other);
        let (strips, nodes) = ([strip(0)], [node(0, 1)]);
        Geometry::new(&[other], &strips, &nodes, true).err()
    };
    assert_eq!(changed(|_| ()), None);
    assert_eq!(changed(|w| w.reflectance = 1.0), None);
    assert_eq!(changed(|w| w.reflectance = 1.1), bad);
    assert_eq!(changed(|w| w.reflectance = -0.1), bad);
    assert_eq!(changed(|w| w.emission = f64::NAN), bad);
    assert_eq!(changed(|w| w.ends[1][1] = 0.1), bad);
    assert_eq!(changed(|w| w.vertices[1] = 2), bad);
    let (strips, nodes) = ([strip(0)], [node(0, 1)]);
    let unseen = Geometry::new(&[wall; 2], &strips, &nodes, true).err();
    assert_eq!(unseen, bad);
    // Children that are their own parents, and that have two.
    assert_eq!(geometry(0, &[node(0, 0), node(0, 1), node(0, 1)]), bad);
    assert_eq!(geometry(0, &[node(1, 0), node(1, 0), node(0, 1)]), bad);
    let twice = [node(1, 0), node(3, 0), node(3, 0), node(0, 1), node(0, 1)];
    assert_eq!(geometry(0, &twice), bad);
    // A tree of more levels than a stack has room for.
    let deep = |levels: u32| -> Vec<Node<f64>> {
        let pair = |k: u32| {
            let inner = if k + 1 < levels {
                node(2 * k + 3, 0)
            } else {
                node(0, 1)
            };
            [inner, node(0, 1)]
        };
        let below = (0..levels).flat_map(pair);
        core::iter::once(node(1, 0)).chain(below).collect()
    };
    assert_eq!(geometry(0, &deep(40)), None);
    assert_eq!(geometry(0, &deep(41)), bad);

    let (walls, strips, nodes) = ([wall], [strip(0)], [node(0, 1)]);
    let good = Geometry::new(&walls, &strips, &nodes, true).unwrap();
    let edge = |along| Edge {
        along,
        position: [along, 0.0],
    };
    let cells = |edges: &[Edge<f64>], walls: &[u32], first: &[u32]| {
        let tables = PartitionTables {
            edges,
            walls,
            first,
        };
        Partition::new(&good, tables).err()
    };
    let edges = [edge(0.0), edge(0.5), edge(1.0)];
    assert_eq!(cells(&edges, &[0, 0], &[0, 2]), None);
    assert_eq!(cells(&edges, &[0, 1], &[0, 2]), bad);
    assert_eq!(cells(&edges, &[0, 0], &[0, 1]), bad);
    assert_eq!(cells(&edges[..2], &[0, 0], &[0, 2]), bad);
    assert_eq!(cells(&edges[..2], &[0], &[0, 1]), bad);
    let twice = [edge(0.0), edge(0.0), edge(1.0)];
    assert_eq!(cells(&twice, &[0, 0], &[0, 2]), bad);
    let tables = PartitionTables {
        edges: &edges,
        walls: &[0, 0],
        first: &[0, 2],
    };
    let partition = Partition::new(&good, tables).unwrap();
    let room = Room::new(good, partition, &[0.0]);
    let length = RoomError::Length {
        expected: 2,
        found: 1,
    };
    assert_eq!(room.err(), Some(length));
}
