//! `fredholm certify`: formulas, tables and form factors beside what is right, and what cannot be read.

use crate::common;

use base64::Engine as _;
use base64::engine::general_purpose::STANDARD;
use common::{Folder, assert_svg, csv_rows, fredholm, list, number, refused};

const LINE: &str = "[problem]\nkind = 'cube'\ndimension = 1\nkernel = 'a * x * y'\nsource = 'x'\n[problem.parameters]\na = 0.5\n\
    [[target]]\nname = 'mean'\nover = 'all'\n";

const ROOM: &str = "[problem]\nkind = 'room'\n\
    [[problem.surface]]\nname = 'floor'\npoints = [[0, 0], [1, 0]]\nreflectance = 0.5\nemission = 0.5\n\
    [[problem.surface]]\nname = 'rest'\npoints = [[1, 0], [1, 1], [0, 1], [0, 0]]\nreflectance = 0.5\nemission = 0.5\n\
    [[target]]\nname = 'all'\nover = 'rest'\n[galerkin]\ncells = 20\ndegree = 1\n[walk]\nwalks = 20000\n";

#[test]
fn formulas_are_right_or_wrong() {
    let folder = Folder::new();
    let line = folder.file("line.toml", LINE);
    let (json, csv, svg) = (folder.at("c.json"), folder.at("c.csv"), folder.at("c.svg"));
    let right = fredholm(&["certify", &line, "--with", "x/(1 - a/3)"]).quietly(0);
    assert!(
        right.stdout.starts_with("right to within "),
        "{}",
        right.stdout
    );
    for out in [&json, &csv, &svg] {
        let certify = ["certify", &line, "--with", "1.21 * x", "--walks", "2000"];
        let wrong = fredholm(&[&certify[..], &["--out", out]].concat()).quietly(1);
        assert!(
            wrong.stdout.starts_with("wrong by 0.0100"),
            "{}",
            wrong.stdout
        );
    }
    let certificate: serde_json::Value =
        serde_json::from_str(&std::fs::read_to_string(&json).unwrap()).unwrap();
    assert_eq!(certificate["verdict"], "wrong");
    assert!((number(&certificate, "bound") - 0.01).abs() < 1e-9);
    let values = list(&certificate, "values");
    assert_eq!(values.len(), 257);
    assert!((number(&values[0], "error") - 0.005).abs() < 1e-9);
    assert_eq!(csv_rows(csv.as_ref()).len(), 258);
    assert_svg(svg.as_ref());
    // Surfaces of a room, at places in the drawing.
    let room = folder.file("room.toml", ROOM);
    assert_eq!(fredholm(&["certify", &room, "--with", "1"]).status, Some(0));
    let wrong = fredholm(&["certify", &room, "--with", "1 + 0.01 * x2"]);
    assert_eq!(wrong.status, Some(1), "{wrong:?}");
}

#[test]
fn tables_are_read_with_and_without_a_head() {
    let folder = Folder::new();
    let [line, room] = [
        folder.file("line.toml", LINE),
        folder.file("room.toml", ROOM),
    ];
    let verdict = |problem: &str, table: &str, status| {
        let table = folder.file("t.csv", table);
        {
            let ran = fredholm(&["certify", problem, "--with", &table]);
            assert_eq!(ran.status, Some(status), "{ran:?}");
            ran.stdout
        }
    };
    verdict(&line, "0,0\n0.5,0.6\n\n# the end\n1,1.2\n", 0);
    verdict(
        &line,
        "\u{feff}name,value,x\r\nmean,0.6,\r\n,0.6,0.5\r\n",
        0,
    );
    // Two digits are right to half of the second one; more are not.
    verdict(&line, "0.5,0.60\n0.7,0.84\n0.333,0.40\n", 0);
    verdict(&line, "0.5,0.6000\n0.333,0.4\n", 1);
    let one = verdict(&line, "x,u,other\n0.5,0.61,7\n0.25,0.30,7\n", 1);
    assert!(one.contains("wrong for certain: 1 of 2 values"), "{one}");
    verdict(&room, "surface,value\nfloor,1.000\nrest,1.000\n", 0);
    verdict(
        &room,
        "surface,t,value\nfloor,0.5,1.000\nrest,0.2,1.001\nrest,0.7,1.00\n",
        1,
    );
    verdict(&room, "floor,0.25,1.0\nrest,0.5,1.0\n", 0);
    // What the program itself has written.
    let own = folder.at("own.csv");
    let few = ["--cells", "20", "--degree", "0", "--out", &own];
    let ran = fredholm(&[&["solve", &room], &few[..]].concat());
    assert_eq!(ran.status, Some(0), "{ran:?}");
    let own = std::fs::read_to_string(own).unwrap();
    let own = folder.file("own.csv", own);
    let ran = fredholm(&["certify", &room, "--with", &own]);
    assert!(ran.stdout.contains("of 1 values"), "{ran:?}");
}

/// x and 1.2 x, compressed, as NumPy 2.4 writes them.
const NPZ: &str = "UEsDBC0AAAAIAAAAIQCXLRFa//////////8FABQAeC5ucHkBABAAoAAAAAAAAABPAAAAAAAAAJvsF+obEMnIUMZQrZ6SWpxcpG6loG6TZqGuo6Cell9UUpSY\
    F59flJIKEndLzClOBYoXZyQWpAL5GiY6mjoKtQoUAC4GFHDBHkI/gNIf7AFQSwMELQAAAAgAAAAhAKl9WSj//////////wcAFABwaGkubnB5AQAQAKAAAAAA\
    AAAAUgAAAAAAAACb7BfqGxDJyFDGUK2eklqcXKRupaBuk2ahrqOgnpZfVFKUmBefX5SSChJ3S8wpTgWKF2ckFqQC+RomOpo6CrUKFAAuBigwBoPL9hD6MZT+\
    bA8AUEsBAi0DLQAAAAgAAAAhAJctEVpPAAAAoAAAAAUAAAAAAAAAAAAAAIABAAAAAHgubnB5UEsBAi0DLQAAAAgAAAAhAKl9WShSAAAAoAAAAAcAAAAAAAAA\
    AAAAAIABhgAAAHBoaS5ucHlQSwUGAAAAAAIAAgBoAAAAEQEAAAAA";
/// The factors of the square in ROOM, as SciPy writes them.
const SPARSE: &str = "UEsDBC0AAAAIAAAAIQAdDwfs//////////8LABQAaW5kaWNlcy5ucHkBABAAjAAAAAAAAABJAAAAAAAAAJvsF+obEMnIUMZQrZ6SWpxcpG6loG6TaaKuo6Ce\
    ll9UUpSYF59flJIKEndLzClOBYoXZyQWpAL5GsY6mjoKtQoUAC5GBggA0QBQSwMELQAAAAgAAAAhAGeLARH//////////woAFABpbmRwdHIubnB5AQAQAIwA\
    AAAAAAAATAAAAAAAAACb7BfqGxDJyFDGUK2eklqcXKRupaBuk2mirqOgnpZfVFKUmBefX5SSChJ3S8wpTgWKF2ckFqQC+RrGOpo6CrUKFAAuBiBgBGJmIAYA\
    UEsDBC0AAAAIAAAAIQCjw3SX//////////8KABQAZm9ybWF0Lm5weQEAEACDAAAAAAAAAEUAAAAAAAAAm+wX6hsQychQxlCtnpJanFykbqWgXhNsrK6joJ6W\
    X1RSlJgXn1+UkgoSd0vMKU4FihdnJBakAvkamjoKtQoUAa7k4iIAUEsDBC0AAAAIAAAAIQD+SNTA//////////8JABQAc2hhcGUubnB5AQAQAJAAAAAAAAAA\
    SQAAAAAAAACb7BfqGxDJyFDGUK2eklqcXKRupaBuk2mhrqOgnpZfVFKUmBefX5SSChJ3S8wpTgWKF2ckFqQC+RpGOpo6CrUKFAAuJgYIgNEAUEsDBC0AAAAI\
    AAAAIQCKq0i6//////////8IABQAZGF0YS5ucHkBABAAmAAAAAAAAABQAAAAAAAAAJvsF+obEMnIUMZQrZ6SWpxcpG6loG6TZqGuo6Cell9UUpSYF59flJIK\
    EndLzClOBYoXZyQWpAL5GsY6mjoKtQoUAC4GMPhgHwoGV6H0U3sAUEsBAi0DLQAAAAgAAAAhAB0PB+xJAAAAjAAAAAsAAAAAAAAAAAAAAIABAAAAAGluZGlj\
    ZXMubnB5UEsBAi0DLQAAAAgAAAAhAGeLARFMAAAAjAAAAAoAAAAAAAAAAAAAAIABhgAAAGluZHB0ci5ucHlQSwECLQMtAAAACAAAACEAo8N0l0UAAACDAAAA\
    CgAAAAAAAAAAAAAAgAEOAQAAZm9ybWF0Lm5weVBLAQItAy0AAAAIAAAAIQD+SNTASQAAAJAAAAAJAAAAAAAAAAAAAACAAY8BAABzaGFwZS5ucHlQSwECLQMt\
    AAAACAAAACEAiqtIulAAAACYAAAACAAAAAAAAAAAAAAAgAETAgAAZGF0YS5ucHlQSwUGAAAAAAUABQAWAQAAnQIAAAAA";
/// The same values at points between lines, as meshio 5.3 writes them.
const VTU: &str = r#"<?xml version="1.0"?>
<VTKFile type="UnstructuredGrid" version="0.1" byte_order="LittleEndian" compressor="vtkZLibDataCompressor">
<UnstructuredGrid>
<Piece NumberOfPoints="4" NumberOfCells="3">
<Points>
<DataArray type="Float64" Name="Points" NumberOfComponents="3" format="binary">AQAAAACAAABgAAAAFgAAAA==eJxjYMAHLthjF3+AQ/wDhjgAieUDXg==</DataArray>
</Points>
<Cells>
<DataArray type="Int64" Name="connectivity" format="binary">AQAAAACAAAAwAAAAEwAAAA==eJxjYIAARjSaCY1mhtIAAOAACg==</DataArray>
<DataArray type="Int64" Name="offsets" format="binary">AQAAAACAAAAYAAAAEAAAAA==eJxjYoAAFijNBqUBALgADQ==</DataArray>
<DataArray type="Int64" Name="types" format="binary">AQAAAACAAAAYAAAADgAAAA==eJxjZoAAZjQaAACoAAo=</DataArray>
</Cells>
<PointData>
<DataArray type="Float64" Name="phi" format="binary">AQAAAACAAAAgAAAAFgAAAA==eJxjYIAAYzC4bA+hH0Ppz/YAUMgG/Q==</DataArray>
</PointData>
</Piece>
</UnstructuredGrid>
</VTKFile>"#;

/// The same values in the middles of the lines, as text.
const ON_CELLS: &str = r#"<VTKFile type="UnstructuredGrid" version="0.1" byte_order="LittleEndian"><UnstructuredGrid>
<Piece NumberOfPoints="4" NumberOfCells="3">
<Points><DataArray type="Float64" NumberOfComponents="3" format="ascii">0 0 0 0.25 0 0 0.5 0 0 1 0 0</DataArray></Points>
<Cells>
<DataArray type="Int64" Name="connectivity" format="ascii">0 1 1 2 2 3</DataArray>
<DataArray type="Int64" Name="offsets" format="ascii">2 4 6</DataArray>
</Cells>
<CellData><DataArray type="Float32" Name="phi" format="ascii">0.15 0.45 0.9</DataArray></CellData>
</Piece></UnstructuredGrid></VTKFile>"#;

#[test]
fn arrays_of_others_are_read() {
    let folder = Folder::new();
    let [line, room] = [
        folder.file("line.toml", LINE),
        folder.file("room.toml", ROOM),
    ];
    let bytes = |text: &str| STANDARD.decode(text).unwrap();
    let certify = |problem: &str, path: &str| {
        let ran = fredholm(&["certify", problem, "--with", path, "--json"]);
        let status = ran.status;
        (status, ran.json())
    };
    for (name, content) in [("n.npz", bytes(NPZ)), ("m.vtu", Vec::from(VTU))] {
        let (status, json) = certify(&line, &folder.file(name, content));
        assert_eq!(status, Some(0), "{name}: {json}");
        assert_eq!(list(&json, "values").len(), 4);
        assert_eq!(number(&json, "rounding"), 0.0);
    }
    // Of cells the values belong to the centres, and those of single precision are rounded.
    let (status, json) = certify(&line, &folder.file("c.vtu", ON_CELLS));
    assert_eq!(status, Some(0), "{json}");
    assert_eq!(list(&json, "values").len(), 3);
    assert!(number(&json, "rounding") > 1e-8);
    // What the program itself has written.
    let own = LINE.replace("over = 'all'", "grid = 5");
    let own = folder.file("own.toml", &own);
    for name in ["own.npz", "own.vtu"] {
        let path = folder.at(name);
        fredholm(&["solve", &own, "--out", &path]).quietly(0);
        let (status, json) = certify(&own, &path);
        assert_eq!(status, Some(0), "{name}: {json}");
        assert!(list(&json, "values").len() >= 5, "{json}");
    }
    let plane = "[problem]\nkind = 'cube'\ndimension = 2\nkernel = '0.5'\nsource = '1 + x1'\n[[target]]\nname = 'u'\ngrid = [4, 3]\n";
    let plane = folder.file("plane.toml", plane);
    let path = folder.at("plane.glb");
    fredholm(&["solve", &plane, "--out", &path]).quietly(0);
    let (status, json) = certify(&plane, &path);
    assert_eq!(status, Some(0), "{json}");
    assert!(list(&json, "values").len() >= 12, "{json}");
    assert!(number(&json, "rounding") > 1e-8);
    let sparse = folder.file("s.npz", bytes(SPARSE));
    let ran = fredholm(&["certify", &room, "--factors", &sparse]);
    assert_eq!(ran.status, Some(0), "{ran:?}");

    let refuse = |name: &str, content: Vec<u8>, words: &[&str]| {
        let path = folder.file(name, content);
        refused(&fredholm(&["certify", &line, "--with", &path]), words);
    };
    refuse(
        "b.npz",
        b"PK".to_vec(),
        &["b.npz: it is no archive of arrays"],
    );
    refuse("e.npz", bytes(SPARSE), &["e.npz: points are wanted"]);
    refuse(
        "b.vtu",
        b"<VTKFile/>".to_vec(),
        &["b.vtu: it has no points"],
    );
    refuse(
        "b.glb",
        b"glTF".to_vec(),
        &["b.glb: it is no glTF with numbers"],
    );
    let broken = VTU.replace("eJxjYMAHLthj", "eJxjYMAH");
    refuse(
        "b.vtu",
        broken.into(),
        &["b.vtu: array \"Points\": it is broken"],
    );
}

#[test]
fn factors_of_others_are_compared() {
    let folder = Folder::new();
    let room = folder.file("room.toml", ROOM);
    let given = |name: &str, text: &str, status| {
        let path = folder.file(name, text);
        fredholm(&["certify", &room, "--factors", &path, "--json"])
            .quietly(status)
            .json()
    };
    let right = "from,to,factor\nfloor,rest,1\nrest,floor,0.333333\nrest,rest,0.666667\n";
    assert_eq!(given("f.csv", right, 0)["wrong"], 0);
    let wrong = given("f.csv", &right.replace("0.666667", "0.666767"), 1);
    assert_eq!(wrong["wrong"], 1);
    assert!((number(&wrong, "row_sum") - 1e-4).abs() < 1e-6, "{wrong}");
    let view3d = "View3D 3.3 0 0 0 2\n1 3\n0.0 1.0\n0.3333333 0.6666667\n1 1\n";
    assert_eq!(given("f.txt", view3d, 0)["wrong"], 0);
    let path = folder.file("g.csv", "from,to,factor\nfloor,roof,1\n");
    refused(
        &fredholm(&["certify", &room, "--factors", &path]),
        &["g.csv:2", "there is no surface \"roof\""],
    );
    let path = folder.file("g.txt", "View3D\n1 3\n0 1\n");
    refused(
        &fredholm(&["certify", &room, "--factors", &path]),
        &["2 areas and 2 rows of 2 factors"],
    );
}

#[test]
fn what_is_no_solution_is_refused_at_its_place() {
    let folder = Folder::new();
    let [line, room] = [
        folder.file("line.toml", LINE),
        folder.file("room.toml", ROOM),
    ];
    let refuse = |problem: &str, with: &str, words: &[&str]| {
        refused(&fredholm(&["certify", problem, "--with", with]), words);
    };
    refuse(&line, "1.2 * z", &["unknown name `z`"]);
    refuse(&line, "none.csv", &["cannot read none.csv"]);
    let table = |text: &str| folder.file("t.csv", text);
    refuse(
        &line,
        &table("x,q\n1,2\n"),
        &["t.csv:1:1", "no column of values"],
    );
    refuse(
        &line,
        &table("x,u\n0.5,1\n1.5,2\n"),
        &["t.csv:3:1", "a coordinate must be from 0 to 1"],
    );
    refuse(
        &line,
        &table("x,u\n0.5,one\n"),
        &["t.csv:2:1", "\"one\" is not a number"],
    );
    refuse(
        &line,
        &table("name,u\nmiddle,1\n"),
        &["t.csv:2:1", "none named \"middle\""],
    );
    refuse(&line, &table("# nothing\n"), &["has no values"]);
    // What a terminal must not be given, and what belongs to other problems.
    refuse(
        &line,
        &table("name,x,u\na\u{7}b,0.5,0.6\n"),
        &["control characters"],
    );
    refuse(
        &line,
        &table("component,x,u\n1,0.5,0.6\n"),
        &["`component` belongs to systems"],
    );
    refuse(&room, &table("roof,0.5,1\n"), &["t.csv:1:1", "roof"]);
    refused(&fredholm(&["certify", &line]), &["--with"]);
    refused(
        &fredholm(&["certify", &line, "--with", "x", "--out", "c.png"]),
        &["must end in .json, .csv or .svg"],
    );
}
