//! Writes the folder `samples` again: `cargo run -p footfall --example samples`.
//!
//! The program is deterministic; the test `samples` compares its files with those of the folder, byte for byte.

#[path = "make.rs"]
mod make;

use std::path::Path;

fn main() -> std::io::Result<()> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../samples");
    for (name, content) in make::all() {
        std::fs::write(folder.join(name), &content)?;
        println!("{name}: {} bytes", content.len());
    }
    Ok(())
}
