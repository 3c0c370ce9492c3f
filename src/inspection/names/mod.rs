//! Names of columns: words, vocabulary, and pairs of mirror images.

pub mod mirror_images;
pub mod vocabulary;
pub mod words;
