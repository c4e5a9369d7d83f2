//! The parts of the command-line program `footfall`.
//!
//! | module | what it contains |
//! |---|---|
//! | [`cli`] | the list of commands and the exit codes |
//! | [`command`] | one file a command: its options and its `run` |
//! | [`options`] | option groups and value parsers that several commands share |
//! | [`board`] | the virtual board as a process, the board's log and serial port, requests, replay on the host, the default control loop |
//! | [`virtual_run`] | a run on the virtual board from preparation to result, shown and recorded |
//! | [`live_run`] | a board that runs by itself, shown live: serial port or debug probe |
//! | `channel` | topics, messages and their definitions, of captures and live views |
//! | [`publish`] | a run that is sent to other programs while it runs |
//! | [`view`] | screens, lines of text, charts |
//! | [`mod@file`] | the files that commands read and write |
//! | [`gait_player`], [`edge_reversal`] | gaits and edge-reversal networks played on the host core |
//! | [`output`], [`messages`] | standard output and files, standard error |
//! | [`failure`], [`interrupt`] | failures, signals |
//! | `spinner` | progress of commands that compute for long |
//! | [`line_fit`] | the straight line of least squares |
//!
//! Data go to standard output, messages to standard error. Exit codes: 0 success, 1 the run failed or its result is not sound,
//! 2 wrong input and nothing written.
#![forbid(unsafe_code)]
// They end the program where the stream cannot be written: `output` has what does not.
#![warn(clippy::print_stdout, clippy::print_stderr)]

#[cfg(feature = "analysis")]
mod answers;
pub mod board;
mod channel;
pub mod cli;
pub mod command;
#[cfg(feature = "analysis")]
pub mod edge_reversal;
pub mod failure;
pub mod file;
#[cfg(feature = "analysis")]
pub mod gait_player;
pub mod interrupt;
pub mod line_fit;
pub mod live_run;
pub mod messages;
pub mod options;
pub mod output;
pub mod publish;
#[cfg(feature = "analysis")]
pub mod spinner;
pub mod view;
pub mod virtual_run;
