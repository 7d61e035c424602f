//! Errors of checkpoints.

use std::path::PathBuf;

use rtsl::{Diagnostic, diagnostic_codes as codes};

use super::Difference;

/// An error of writing or resuming a checkpoint.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum CheckpointError {
    /// The file cannot be read.
    #[error("cannot read the checkpoint `{}`: {reason}", path.display())]
    Unreadable {
        /// The file.
        path: PathBuf,
        /// The system's error message.
        reason: String,
    },
    /// The file cannot be written.
    #[error("cannot write the checkpoint `{}`: {reason}", path.display())]
    Unwritable {
        /// The file.
        path: PathBuf,
        /// The system's error message.
        reason: String,
    },
    /// The file is not a checkpoint, or is damaged.
    #[error("`{}` cannot be resumed: {damage}", path.display())]
    Damaged {
        /// The file.
        path: PathBuf,
        /// The damage.
        damage: Damage,
    },
    /// The checkpoint belongs to another render.
    #[error("`{}` belongs to another render: {difference}", path.display())]
    Foreign {
        /// The file.
        path: PathBuf,
        /// The first difference.
        difference: Difference,
    },
    /// The path is occupied by something else, which is not overwritten.
    #[error("`{}` is not overwritten: {occupant}", path.display())]
    Occupied {
        /// The file.
        path: PathBuf,
        /// The content of the file.
        occupant: Occupant,
    },
}

/// The file at the path of a checkpoint.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum Occupant {
    /// The file is not a checkpoint, or cannot be identified as one.
    #[error("{0}")]
    Unknown(Damage),
    /// The checkpoint of another render.
    #[error("it is the checkpoint of another render: {0}")]
    OtherRender(Difference),
}

impl CheckpointError {
    /// The diagnostic of the error.
    pub fn diagnostic(&self) -> Diagnostic {
        let message = self.to_string();
        match self {
            CheckpointError::Unreadable { .. } => Diagnostic::new(codes::UNREADABLE_FILE, message),
            CheckpointError::Unwritable { .. } => Diagnostic::new(codes::UNWRITABLE_FILE, message)
                .note("the previous file was not changed"),
            CheckpointError::Damaged { .. } => Diagnostic::new(codes::BAD_CHECKPOINT, message)
                .help("delete it, then render without `--resume`"),
            CheckpointError::Foreign { .. } => Diagnostic::new(codes::FOREIGN_CHECKPOINT, message)
                .help("restore the difference, or use another checkpoint file for this render"),
            CheckpointError::Occupied { .. } => {
                Diagnostic::new(codes::OCCUPIED_CHECKPOINT, message).help(OCCUPIED_REMEDY)
            }
        }
    }

    /// The diagnostic before the render begins, when nothing is lost yet.
    pub fn early_warning(&self) -> Diagnostic {
        let diagnostic = Diagnostic::new(codes::NO_CHECKPOINT, self.to_string())
            .note("a render that ends early will then leave no checkpoint");
        match self {
            CheckpointError::Occupied { .. } => diagnostic.help(OCCUPIED_REMEDY),
            CheckpointError::Unreadable { .. }
            | CheckpointError::Unwritable { .. }
            | CheckpointError::Damaged { .. }
            | CheckpointError::Foreign { .. } => diagnostic,
        }
    }
}

const OCCUPIED_REMEDY: &str = "delete it, or name another file with `--checkpoint`";

/// Damage of a checkpoint's bytes.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum Damage {
    /// The file does not start with the magic bytes.
    #[error("it is not a checkpoint")]
    NotACheckpoint,
    /// The version of the format is not supported.
    #[error("it has version {0} of the format, and this program reads version {1}")]
    UnknownVersion(u32, u32),
    /// Bytes are missing at the end.
    #[error("it is truncated: it has {found} of {expected} bytes")]
    Truncated {
        /// The length in the header.
        expected: u64,
        /// The actual length.
        found: u64,
    },
    /// The checksum is wrong.
    #[error("its checksum is wrong: the file was changed, or the disk failed")]
    Checksum,
    /// The content is inconsistent.
    #[error("{0}")]
    Malformed(String),
    /// The system reported an error while reading.
    #[error("{0}")]
    Unreadable(String),
}
