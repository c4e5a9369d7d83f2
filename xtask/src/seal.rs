//! Writes the seal into an image after the link: the check sum by which the board proves its program (`firmware/src/seal.rs`).

use anyhow::{Context, Result, bail, ensure};
use crc::{CRC_32_ISO_HDLC, Crc};

use crate::image::{self, Part};

/// Address of the seal's first word, as `firmware/src/seal.rs` has it; `tests/board_program.rs` reads a sealed image by that.
const SEAL: u32 = 0x0800_3FF4;
/// The first word.
const MARK: [u8; 4] = *b"SEAL";
/// What the linker leaves at the place of the seal.
const ERASED: [u8; 12] = [0xFF; 12];

const NO_PLACE: &str = "the image has no place for its seal (firmware/seal.x): build it by `cargo xtask build`";

/// Seals the image; one that is sealed already stays as it is.
///
/// # Errors
/// What is wrong with the file.
pub(crate) fn seal(elf: &mut [u8]) -> Result<()> {
    let place = image::place(elf, SEAL, ERASED.len())?.context(NO_PLACE)?;
    let words = &mut elf[place.clone()];
    let is_free = words == ERASED || words.starts_with(&MARK);
    ensure!(is_free, "there is something else at the place of the image's seal");
    words.copy_from_slice(&ERASED);
    let parts = image::flash_parts(elf)?;
    let [first, text] = parts.as_slice() else { bail!("the image has no part after the parameter sectors") };
    let end = text.address + text.bytes.len() as u32;
    let head = [MARK, end.to_le_bytes()].concat();
    let sum = sum(first, &head, text)?;
    for (byte, sealed) in elf[place].iter_mut().zip(head.into_iter().chain(sum.to_le_bytes())) {
        *byte = sealed;
    }
    Ok(())
}

/// The check sum of the flash from its beginning, with `head` as the first words of the seal, and of the text.
fn sum(first: &Part, head: &[u8], text: &Part) -> Result<u32> {
    let crc = Crc::<u32>::new(&CRC_32_ISO_HDLC);
    let mut digest = crc.digest();
    let before = SEAL.checked_sub(first.address).and_then(|bytes| first.bytes.get(..bytes as usize));
    let before = before.filter(|_| first.address == 0x0800_0000);
    digest.update(before.context("the image does not begin with the flash")?);
    digest.update(head);
    digest.update(&text.bytes);
    Ok(digest.finalize())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::image::tests::with_segments;

    const VECTORS: (u32, &[u8]) = (0x0800_0000, b"vectors");
    const PLACE: (u32, &[u8]) = (SEAL, &ERASED);

    fn words(elf: &[u8]) -> [u32; 3] {
        let parts = image::flash_parts(elf).unwrap();
        let seal = &parts[0].bytes[parts[0].bytes.len() - 12..];
        [0, 4, 8].map(|at| u32::from_le_bytes(seal[at..at + 4].try_into().unwrap()))
    }

    #[test]
    fn a_sealed_image_has_mark_end_and_check_sum() {
        let mut elf = with_segments(&[VECTORS, PLACE, (0x0801_0000, b"text"), (0x0801_0008, b"data")]);
        seal(&mut elf).unwrap();
        let [mark, end, sum] = words(&elf);
        assert_eq!((mark.to_le_bytes(), end), (*b"SEAL", 0x0801_000C));
        // Gaps are erased.
        let mut flash = b"vectors".to_vec();
        flash.resize(0x3FF4, 0xFF);
        flash.extend_from_slice(b"SEAL\x0C\x00\x01\x08text\xFF\xFF\xFF\xFFdata");
        assert_eq!(sum, crc::Crc::<u32>::new(&CRC_32_ISO_HDLC).checksum(&flash));
        let once = elf.clone();
        seal(&mut elf).unwrap();
        assert!(elf == once, "a second time changes nothing");
    }

    #[test]
    fn an_image_without_its_place_is_refused() {
        let text = (0x0801_0000, &b"text"[..]);
        for (segments, words) in [
            (vec![VECTORS, text], "no place for its seal"),
            (vec![VECTORS, (SEAL, b"something else"), text], "something else"),
            (vec![VECTORS, PLACE], "no part after"),
            (vec![(0x0800_0010, &b"vectors"[..]), PLACE, text], "does not begin"),
        ] {
            let error = seal(&mut with_segments(&segments)).unwrap_err().to_string();
            assert!(error.contains(words), "{error}");
        }
        let whole = with_segments(&[VECTORS, PLACE, text]);
        for length in 0..whole.len() {
            assert!(seal(&mut whole[..length].to_vec()).is_err(), "{length}");
        }
    }
}
