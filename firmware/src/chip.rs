//! Compares the chip with the one that the image is for, before anything runs by the tables of a board.

use embassy_stm32::pac::DBGMCU;
use firmware::board::{BOARD, BOARDS, OtherChip};

/// Whether the chip is the board's.
///
/// # Errors
/// It is another one.
pub(crate) fn compare() -> Result<(), OtherChip> {
    BOARD.compare(DBGMCU.idcode().read().dev_id(), &BOARDS)
}
