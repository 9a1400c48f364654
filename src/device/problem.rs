//! What is wrong with a profile, and where.

use std::fmt;

use crate::section::Problem;

/// Says everything that is wrong with a profile; its text has a line for each problem.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ProfileError {
    name: String,
    problems: Vec<Problem>,
}

impl ProfileError {
    pub(super) fn new(name: &str, problems: Vec<Problem>) -> Self {
        ProfileError { name: name.to_owned(), problems }
    }

    /// Returns the problems in the order of the text.
    pub fn problems(&self) -> &[Problem] {
        &self.problems
    }
}

impl fmt::Display for ProfileError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for (index, problem) in self.problems.iter().enumerate() {
            let separator = if index == 0 { "" } else { "\n" };
            write!(f, "{separator}{}:{problem}", self.name)?;
        }
        Ok(())
    }
}

impl std::error::Error for ProfileError {}
