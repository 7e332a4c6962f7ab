//! The C library starts the program; without std nobody else asks for it.
fn main() {
    println!("cargo:rustc-link-lib=c");
}
