//! Readers and writers of recordings: one file per format, and what they share.

pub(crate) mod angle_columns;
pub mod c3d;
pub(crate) mod calibrated;
pub(crate) mod choice;
pub(crate) mod column;
pub mod converted;
pub mod csv_file;
pub(crate) mod csv_header;
pub(crate) mod description;
pub mod joint_names;
pub mod mapped_csv;
pub mod mcap_file;
pub mod mvnx;
pub mod open;
pub mod opensim;
pub mod page;
pub mod scope;
pub(crate) mod segments;
pub(crate) mod text_table;
pub(crate) mod time_names;
pub mod trc;
pub(crate) mod unit;
pub(crate) mod unsupported;
pub mod whole_file;
