//! The connection of a program built without object stores: every request fails with that reason.

use std::collections::BTreeMap;
use std::ops::Range;

use bytes::Bytes;

use super::failure::{ObjectInfo, RequestFailure};

/// No connection.
#[derive(Debug)]
pub enum Client {}

pub fn available() -> Result<(), RequestFailure> {
    let what = "this harvest was built without object stores; build one with them: cargo build --release --features s3";
    Err(RequestFailure::Permanent(what.to_owned()))
}

impl Client {
    pub fn open(_: &str) -> Result<Client, RequestFailure> {
        available().and_then(|()| Err(RequestFailure::Permanent(String::new())))
    }

    pub fn list(&self, _: &str) -> Result<BTreeMap<String, ObjectInfo>, RequestFailure> {
        match *self {}
    }

    pub fn remember(&self, _: String, _: ObjectInfo) {
        match *self {}
    }

    pub fn remove(&self, _: &str) -> Result<(), RequestFailure> {
        match *self {}
    }

    pub fn listed(&self, _: &str) -> Option<ObjectInfo> {
        match *self {}
    }

    pub fn about(&self, _: &str) -> Result<Option<ObjectInfo>, RequestFailure> {
        match *self {}
    }

    pub fn failed(&self, _: &str) -> Option<String> {
        match *self {}
    }

    pub fn get(&self, _: &str) -> Result<Option<Bytes>, RequestFailure> {
        match *self {}
    }

    pub fn range(&self, _: &str, _: Range<u64>, _: Option<&str>) -> Result<Bytes, RequestFailure> {
        match *self {}
    }

    pub fn put(&self, _: &str, _: Vec<u8>) -> Result<(), RequestFailure> {
        match *self {}
    }

    pub fn put_parts(
        &self,
        _: &str,
        _: Vec<u8>,
        _: &mut dyn FnMut() -> Result<Vec<u8>, RequestFailure>,
    ) -> Result<(), RequestFailure> {
        match *self {}
    }
}
