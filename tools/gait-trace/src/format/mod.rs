//! Readers and writers of recordings: one file per format, and what they share.

pub(crate) mod angle_columns;
pub mod c3d;
pub mod converted;
pub mod csv_file;
pub mod joint_names;
pub mod mapped_csv;
pub mod mcap_file;
pub mod open;
pub mod opensim;
pub mod scope;
pub(crate) mod text_table;
pub mod whole_file;
