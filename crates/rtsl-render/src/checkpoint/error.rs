//! Why a checkpoint cannot be written or used.

use std::path::PathBuf;

use rtsl::{Diagnostic, diagnostic_codes as codes};

use super::Difference;

/// Why a checkpoint cannot be written or used.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum CheckpointError {
    /// The system does not let it be read.
    #[error("cannot read the checkpoint `{}`: {reason}", path.display())]
    Unreadable {
        /// The file.
        path: PathBuf,
        /// The system's words.
        reason: String,
    },
    /// The system does not let it be written.
    #[error("cannot write the checkpoint `{}`: {reason}", path.display())]
    Unwritable {
        /// The file.
        path: PathBuf,
        /// The system's words.
        reason: String,
    },
    /// It is none, or no whole one.
    #[error("`{}` cannot be resumed: {damage}", path.display())]
    Damaged {
        /// The file.
        path: PathBuf,
        /// What is wrong with it.
        damage: Damage,
    },
    /// It is of another render.
    #[error("`{}` is of another render: {difference}", path.display())]
    Foreign {
        /// The file.
        path: PathBuf,
        /// The first difference.
        difference: Difference,
    },
    /// Its place holds something else, which is kept.
    #[error("`{}` is not overwritten: {occupant}", path.display())]
    Occupied {
        /// The file.
        path: PathBuf,
        /// What it is.
        occupant: Occupant,
    },
}

/// What stands where a checkpoint should be written.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum Occupant {
    /// No checkpoint, or none that can be told.
    #[error("{0}")]
    Unknown(Damage),
    /// The checkpoint of another render.
    #[error("it is the checkpoint of another render: {0}")]
    OtherRender(Difference),
}

impl CheckpointError {
    /// The error as users read it.
    pub fn diagnostic(&self) -> Diagnostic {
        let message = self.to_string();
        match self {
            CheckpointError::Unreadable { .. } => Diagnostic::new(codes::UNREADABLE_FILE, message),
            CheckpointError::Unwritable { .. } => Diagnostic::new(codes::UNWRITABLE_FILE, message)
                .note("what stood there before is as it was"),
            CheckpointError::Damaged { .. } => Diagnostic::new(codes::BAD_CHECKPOINT, message)
                .help("delete it, then render without `--resume`"),
            CheckpointError::Foreign { .. } => Diagnostic::new(codes::FOREIGN_CHECKPOINT, message)
                .help("restore what differs, or give this render a checkpoint of its own"),
            CheckpointError::Occupied { .. } => {
                Diagnostic::new(codes::OCCUPIED_CHECKPOINT, message).help(OCCUPIED_REMEDY)
            }
        }
    }

    /// The same before the render begins, where nothing is lost yet.
    pub fn early_warning(&self) -> Diagnostic {
        let diagnostic = Diagnostic::new(codes::NO_CHECKPOINT, self.to_string())
            .note("a render that ends early leaves no checkpoint then");
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

/// What is wrong with the bytes of a checkpoint.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum Damage {
    /// They begin otherwise.
    #[error("it is no checkpoint")]
    NotACheckpoint,
    /// Another program wrote it.
    #[error("it has version {0} of the format, and this program reads version {1}")]
    UnknownVersion(u32, u32),
    /// Bytes are missing at the end.
    #[error("it was cut off: of {expected} bytes there are {found}")]
    Truncated {
        /// How many it says it has.
        expected: u64,
        /// How many there are.
        found: u64,
    },
    /// Something changed since it was written.
    #[error("its checksum does not fit: it was changed, or the disk failed")]
    Checksum,
    /// It says something that cannot be.
    #[error("{0}")]
    Malformed(String),
    /// The system stopped reading.
    #[error("{0}")]
    Unreadable(String),
}
