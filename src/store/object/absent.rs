//! The connection of a program built without object stores: every request fails with that reason.

use std::collections::BTreeMap;
use std::ops::Range;

use bytes::Bytes;

use super::failure::{Failure, ObjectInfo};

/// No connection.
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

    pub fn list(&self, _: &str) -> Result<BTreeMap<String, ObjectInfo>, Failure> {
        match *self {}
    }

    pub fn remember(&self, _: String, _: ObjectInfo) {
        match *self {}
    }

    pub fn remove(&self, _: &str) -> Result<(), Failure> {
        match *self {}
    }

    pub fn listed(&self, _: &str) -> Option<ObjectInfo> {
        match *self {}
    }

    pub fn about(&self, _: &str) -> Result<Option<ObjectInfo>, Failure> {
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
