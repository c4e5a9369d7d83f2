//! What the command-line program `footfall` is made of.
//!
//! | module | what it is for |
//! |---|---|
//! | [`cli`] | the command line, and how a call ends |
//! | [`watch`] | the command that runs an image on the virtual board and shows it live |
//! | [`fit`], [`convert`] | the commands that fit recordings, and that turn one kind of file into another |
//! | [`pack`] | a walker's parameters or the worn sensors for the board's flash, or a walker for Rust |
//! | [`volts`], [`check`] | the commands that turn a recording into volts, and that check files |
//! | [`board_process`], [`board_lines`] | the virtual board as a process, and what it writes |
//! | [`image`], [`telemetry`] | the log of the board: bytes to text, text to records |
//! | [`replay`], [`shipped`] | the host's copy of the board's loop, fed with what the board was fed |
//! | [`session`], [`summary`] | the books of a run, and what it comes to |
//! | [`view`], [`screen`], [`plain`] | what there is to see, on a screen and in lines of text |
//! | [`record`], [`capture`] | the command that records what a board measures, and captures as files: CSV, MCAP |
//! | [`rhythm`] | the commands that show generators: walk, obb, hexapod, certify |
//! | [`entrain`] | the command that lets the core follow one sensor of a recorded walker |
//! | [`feed`], [`worn`] | a recording as volts at the sensors' pins, and which sensors are worn |
//! | [`calibrate`](mod@calibrate) | the command that makes a sensor's calibration from known angles |
//! | [`calibration_file`], [`parameter_file`], [`degrees`] | files that people write |
//! | [`failure`] | how a command ends when it does not end well |
//!
//! Data go to standard output, talk to standard error. Exit codes: 0 done and sound, 1 not, 2 bad input and nothing written.
#![forbid(unsafe_code)]

pub mod board;
pub mod cli;
pub mod command;
pub mod failure;
pub mod file;
pub mod view;
