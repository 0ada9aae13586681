//! Whole drawings, planned and looked at from outside.
