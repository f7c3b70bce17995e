use std::path::{Path, PathBuf};

/// Why a file could not be used: `<file>: expected …, got …; <what to do>`.
#[derive(Debug, thiserror::Error)]
pub enum Error {
    /// The operating system refused.
    #[error("{}: {source}", file.display())]
    Io {
        /// Which file.
        file: PathBuf,
        /// What the system said.
        source: std::io::Error,
    },
    /// The content is not what the format allows, or not supported.
    #[error("{}: {problem}", file.display())]
    Content {
        /// Which file.
        file: PathBuf,
        /// Expected, got, and what to do.
        problem: String,
    },
}

impl Error {
    /// A content error. `problem` reads "expected …, got …; what to do".
    pub fn content(file: &Path, problem: impl Into<String>) -> Error {
        Error::Content { file: file.to_owned(), problem: problem.into() }
    }

    /// An input or output error.
    pub fn io(file: &Path, source: std::io::Error) -> Error {
        Error::Io { file: file.to_owned(), source }
    }
}
