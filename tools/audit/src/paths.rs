//! Absolute paths in the bytes that are loaded, and whether two images load the same.

use anyhow::{Result, ensure};

use crate::image::Image;

/// The beginning of paths in Rust's library as its makers compile it: a name that is on no computer.
const LIBRARY: &str = "/rustc/";

/// Folders at the root of a file system under which people build. A text that begins with another slash is no path: `/s`, `//`.
const ROOTS: &[&str] =
    &["/home/", "/root/", "/usr/", "/tmp/", "/var/", "/opt/", "/mnt/", "/Users/", "/builds/", "/github/"];

/// The absolute paths in the loaded bytes, each from its beginning to the first byte that is no letter of a path.
///
/// Texts of a program follow each other without a gap, so a path can begin anywhere: what begins with one of the usual folders counts, with
/// the drives of Windows, and with `here`, the folder of this build. `/build/` is none of them: build scripts write below `target/release/build/`.
#[must_use]
pub fn absolute(image: &Image, here: &str) -> Vec<String> {
    let mut found = Vec::new();
    for part in &image.loaded {
        // One character a byte, so that places in the text are places in the bytes.
        let text: String =
            part.bytes.iter().map(|&byte| if byte.is_ascii_graphic() { byte as char } else { ' ' }).collect();
        for at in 0..text.len() {
            let rest = &text[at..];
            let drive = rest.as_bytes();
            let on_drive = matches!(drive, [b'A'..=b'Z', b':', b'\\', b'a'..=b'z' | b'A'..=b'Z', ..]);
            let is_root = ROOTS.iter().any(|root| rest.starts_with(root)) || (here.len() > 1 && rest.starts_with(here));
            if (is_root || on_drive) && !rest.starts_with(LIBRARY) {
                found.push(rest.split(' ').next().unwrap_or_default().chars().take(160).collect());
            }
        }
    }
    found.sort();
    found.dedup();
    found
}

/// Checks that two images load the same bytes at the same addresses; returns how many.
///
/// # Errors
///
/// With the address of the first difference.
pub fn same(one: &Image, other: &Image) -> Result<usize> {
    let layout = |image: &Image| image.loaded.iter().map(|part| (part.address, part.bytes.len())).collect::<Vec<_>>();
    let pairs = || one.loaded.iter().zip(&other.loaded);
    let difference = pairs().find_map(|(one, other)| {
        let offset = one.bytes.iter().zip(&other.bytes).position(|(one, other)| one != other)?;
        Some(one.address + offset as u32)
    });
    if let Some(address) = difference {
        anyhow::bail!("the loaded bytes differ first at {address:#010x}");
    }
    ensure!(
        layout(one) == layout(other),
        "the images load parts of other lengths: {:?}, {:?}",
        layout(one),
        layout(other)
    );
    Ok(one.loaded.iter().map(|part| part.bytes.len()).sum())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::image::Loaded;

    fn image(bytes: &[u8]) -> Image {
        let loaded = vec![Loaded { address: 0x0800_0000, bytes: bytes.to_vec() }];
        Image { functions: Vec::new(), loaded, compiler: String::new(), flash: 0, ram: 0 }
    }

    #[test]
    fn a_path_in_the_middle_of_texts_is_found() {
        let found = |text: &str| absolute(&image(text.as_bytes()), "/srv/me");
        assert_eq!(found("wrong value/home/me/a.rs\0rest"), ["/home/me/a.rs"]);
        assert_eq!(found("x/srv/me/b.rs\0"), ["/srv/me/b.rs"]);
        assert_eq!(found("a\0C:\\me\\c.rs\0"), ["C:\\me\\c.rs"]);
        assert!(
            found("./firmware/src/a.rs registry/embassy-1/src/b.rs m/s /rustc/59807616/library/core/src/c.rs")
                .is_empty()
        );
    }

    #[test]
    fn one_other_byte_is_named_by_its_address() {
        assert_eq!(same(&image(b"abc"), &image(b"abc")).unwrap(), 3);
        let error = same(&image(b"abc"), &image(b"abd")).unwrap_err().to_string();
        assert!(error.contains("0x08000002"), "{error}");
        assert!(same(&image(b"abc"), &image(b"abcd")).is_err());
    }
}
