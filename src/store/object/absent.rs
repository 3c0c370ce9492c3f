//! What stands in place of the connection in a program that was built without object stores: an
//! error that says so.

use std::collections::BTreeMap;
use std::ops::Range;

use bytes::Bytes;

use super::{About, Failure};

/// There is none.
#[derive(Debug)]
pub enum Client {}

pub fn available() -> Result<(), Failure> {
    let what = "this harvest was built without object stores; build one with them: cargo build --release --features s3";
    Err(Failure::Lasting(what.to_owned()))
}

impl Client {
    pub fn open(_: &str) -> Result<Client, Failure> {
        available().and_then(|()| Err(Failure::Lasting(String::new())))
    }

    pub fn list(&self, _: &str) -> Result<BTreeMap<String, About>, Failure> {
        match *self {}
    }

    pub fn remember(&self, _: String, _: About) {
        match *self {}
    }

    pub fn remove(&self, _: &str) -> Result<(), Failure> {
        match *self {}
    }

    pub fn listed(&self, _: &str) -> Option<About> {
        match *self {}
    }

    pub fn about(&self, _: &str) -> Result<Option<About>, Failure> {
        match *self {}
    }

    pub fn failed(&self, _: &str) -> Option<String> {
        match *self {}
    }

    pub fn get(&self, _: &str) -> Result<Option<Bytes>, Failure> {
        match *self {}
    }

    pub fn range(&self, _: &str, _: Range<u64>, _: Option<&str>) -> Result<Bytes, Failure> {
        match *self {}
    }

    pub fn put(&self, _: &str, _: Vec<u8>) -> Result<(), Failure> {
        match *self {}
    }

    pub fn put_parts(
        &self,
        _: &str,
        _: Vec<u8>,
        _: &mut dyn FnMut() -> Result<Vec<u8>, Failure>,
    ) -> Result<(), Failure> {
        match *self {}
    }
}
