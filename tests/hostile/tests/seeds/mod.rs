//! What is good, and parts of it, to be spoilt.
#![allow(dead_code, reason = "every test file uses a part of it")]

pub(crate) const FILES: [&[u8]; 8] = [
    include_bytes!("../../../../examples/circle.toml"),
    include_bytes!("../../../../examples/gauss.toml"),
    include_bytes!("../../../../examples/doorway.toml"),
    include_bytes!("../../../../examples/facet.toml"),
    include_bytes!("../../../../examples/furnished.toml"),
    include_bytes!("../../../../runners/file/templates/circle.toml"),
    include_bytes!("../../../../runners/file/templates/cube.toml"),
    include_bytes!("../../../../runners/file/templates/room.toml"),
];
pub(crate) const DECKS: [&[u8]; 1] = [include_bytes!("../../../../examples/facet.vs2")];
/// Behind the byte of their format.
pub(crate) const SCENES: [&[u8]; 9] = [
    b"\0o a\nusemtl b\nv 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 2 2 0.5\nf 1/1/1 2//1 3 4\nf -5 -4 -3 -2 -1\n",
    b"\x01solid a\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\nendloop\nendfacet\nendsolid\n",
    b"\x02ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\nelement face \
      1\nproperty list uchar int vertex_indices\nend_header\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n",
    b"\x03T a\nC encl=0\nF 3\nV 1 0 0 0\nV 2 1 0 0\nV 3 0 1 0\nS 1 1 2 3 0 0 0 0.5 a\nS 2 1 3 2 0 0 1 0.5\nEnd of data\n",
    // The same of bytes, and a room that is closed.
    b"\x01a                                                                               \x01\0\0\0\
      \0\0\0\0\0\0\0\0\0\0\x80\x3f\0\0\0\0\0\0\0\0\0\0\0\0\0\0\x80\x3f\0\0\0\0\0\0\0\0\0\0\0\0\0\0\x80\x3f\0\0\0\0\0\0",
    b"\x02ply\nformat binary_little_endian 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\nelement \
      face 1\nproperty list uchar uchar vertex_indices\nend_header\n\0\0\0\0\0\0\0\0\0\0\0\0\0\0\x80\x3f\0\0\0\0\0\0\0\0\0\0\0\0\0\0\x80\x3f\
      \0\0\0\0\x03\0\x01\x02",
    b"\0v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 0 0 1\nv 1 0 1\nv 1 1 1\nv 0 1 1\nf 1 2 3 4\nf 5 8 7 6\nf 1 5 6 2\nf 2 6 7 3\n\
      f 3 7 8 4\nf 4 8 5 1\n",
    b"\x04[problem]\nkind = \"scene\"\nopen = true\nsymmetry = { x = 0 }\n[[problem.surface]]\nname = \"a\"\npolygon = [[0,0,0],[1,0,0],[0,1,0]]\n\
      rotate = [10, 0, 0]\n[[problem.surface]]\nname = \"b\"\nbox = [[0,0,1],[1,1,2]]\n",
    b"\x04[problem]\nkind = \"scene\"\nsky = { altitudes = [0, 20, 90], sectors = [3, 1] }\n[[problem.surface]]\nname = \"a\"\nbox \
      = [[0,0,0],[1,1,2]]\n[[problem.surface]]\nname = \"b\"\npolygon = [[2,0,0],[3,0,0],[3,2,0]]\n",
];
pub(crate) const TABLES: [&[u8]; 2] = [
    include_bytes!("../../../../runners/embedded/firmware/tables/circle_f32.bin"),
    include_bytes!("../../../../runners/embedded/firmware/tables/scene_f32.bin"),
];
/// Parts of files, decks and formulas, good and bad.
pub(crate) const PIECES: [&str; 64] = [
    "[",
    "]",
    "{",
    "}",
    "(",
    ")",
    "\"",
    "'",
    "\"\"\"",
    "=",
    ".",
    ",",
    "#",
    "\\",
    "\n",
    "\r",
    "\t",
    " ",
    "\0",
    "\u{feff}",
    "\u{1b}[31m",
    "é",
    "0",
    "1",
    "-",
    "+",
    "nan",
    "inf",
    "1e999",
    "1e-320",
    "0x",
    "99999999999999999999",
    "[problem]\n",
    "[[target]]\n",
    "[walk]\n",
    "kind = \"cube\"\n",
    "a = 1\n",
    "a.b.c = ",
    "at = 0.5\n",
    "over = \"all\"\n",
    "1979-05-27",
    "true",
    "G 2\n",
    "V 1 0 0\n",
    "S 1 1 2 0 0 0 0.9 ",
    "C 0\n",
    "End of data\n",
    "!",
    "/",
    "x",
    "y",
    "x1",
    "y3",
    "pi",
    "*",
    "^",
    "%",
    "<",
    "==",
    "? 1 :",
    "&&",
    "sin(",
    "min(x, y)",
    "atan2(",
];
