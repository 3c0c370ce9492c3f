//! Declaration of settings: field, default and explanation in one place.
//!
//! From one declaration [`settings!`] makes the struct that stages read, its defaults, its parser
//! and its [`Key`]s, from which `docs/settings.md` is made. A stage first declares the keys that an
//! analyst decides, then those under `expert:` in the YAML. The stage reads both as fields of one
//! struct.

use std::collections::{BTreeMap, BTreeSet};
use std::path::PathBuf;

use serde::Serialize;
use serde::de::DeserializeOwned;
use serde_json::{Map, Value};

/// One key of a configuration file.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Key {
    /// Names from the outermost section inwards; `<name>` is one that the analyst gives.
    pub path: Vec<&'static str>,
    /// Default as YAML; `None` for a key that must be given.
    pub default: Option<String>,
    /// Meaning, unit and effect of a change.
    pub explanation: String,
}

impl Key {
    /// The path as written in pages and messages: `ingest: expert: checks: block_s`.
    #[must_use]
    pub fn written(&self) -> String {
        self.path.join(": ")
    }

    fn below(mut self, outer: &[&'static str]) -> Key {
        self.path.splice(0..0, outer.iter().copied());
        self
    }
}

/// A value that a configuration file holds: a single value, or a group of keys.
pub trait Setting {
    /// Groups have no row of their own in the page of settings.
    const IS_GROUP: bool = false;

    /// Keys below this value; none for a single value.
    #[must_use]
    fn keys() -> Vec<Key> {
        Vec::new()
    }
}

/// Declares types of single values: numbers, words, choices.
macro_rules! single_values {
    ($($type:ty),* $(,)?) => { $( impl $crate::settings::Setting for $type {} )* };
}
pub(crate) use single_values;

single_values!(bool, f64, usize, String, PathBuf, Vec<f64>, Vec<PathBuf>);
single_values!(Vec<String>, BTreeSet<String>, BTreeMap<String, f64>);
single_values!(BTreeMap<String, String>);

impl<T: Setting> Setting for Option<T> {
    fn keys() -> Vec<Key> {
        T::keys()
    }
}

/// Keys of a field: its own key, unless it is a group, and the keys below it.
#[must_use]
pub fn keys_of<T: Setting>(
    path: &[&'static str],
    default: Option<String>,
    documentation: &[&str],
) -> Vec<Key> {
    let own = Key {
        path: path.to_vec(),
        default,
        explanation: documentation.join("").trim().to_owned(),
    };
    let own = (!T::IS_GROUP).then_some(own);
    own.into_iter().chain(below(path, T::keys())).collect()
}

/// Keys with outer names before theirs.
#[must_use]
pub fn below(path: &[&'static str], keys: Vec<Key>) -> Vec<Key> {
    keys.into_iter().map(|key| key.below(path)).collect()
}

/// Declares maps or lists of groups: `elements!(Vec<Group>: Group as "[]")`.
macro_rules! elements {
    ($container:ty: $element:ty as $name:literal) => {
        impl $crate::settings::Setting for $container {
            fn keys() -> Vec<$crate::settings::Key> {
                let keys = <$element as $crate::settings::Setting>::keys();
                $crate::settings::below(&[$name], keys)
            }
        }
    };
}
pub(crate) use elements;

/// Default as YAML on one line, with the keys that may be written and no others.
pub fn written_default<T: Setting + Serialize>(default: &T) -> Option<String> {
    let value = serde_json::to_value(default).ok()?;
    let keys = T::keys();
    let paths: Vec<&[&str]> = keys.iter().map(|key| &key.path[..]).collect();
    Some(one_line(&value, &paths))
}

/// A value as YAML on one line. `paths` are the keys below the value; without any, all of its
/// members are written. A member that is `null` is left out.
fn one_line(value: &Value, paths: &[&[&str]]) -> String {
    match value {
        Value::Array(entries) => {
            let below = below_name(paths, "[]");
            let entries: Vec<String> = entries.iter().map(|e| one_line(e, &below)).collect();
            format!("[{}]", entries.join(", "))
        }
        Value::Object(members) => {
            let names = member_names(members, paths);
            let written = names.into_iter().filter_map(|name| {
                let member = members.get(name).filter(|m| !m.is_null())?;
                let text = one_line(member, &below_name(paths, name));
                Some(format!("{name}: {text}"))
            });
            let written: Vec<String> = written.collect();
            if written.is_empty() {
                return "{}".to_owned();
            }
            format!("{{ {} }}", written.join(", "))
        }
        single => {
            let text = single.to_string();
            text.strip_suffix(".0").unwrap_or(&text).to_owned()
        }
    }
}

/// Names of a map's members in the order of their keys.
fn member_names<'a>(members: &'a Map<String, Value>, paths: &[&[&'a str]]) -> Vec<&'a str> {
    if paths.is_empty() {
        return members.keys().map(String::as_str).collect();
    }
    let mut names: Vec<&str> = paths.iter().filter_map(|p| p.first().copied()).collect();
    names.dedup();
    names
}

/// Paths below a name.
fn below_name<'a>(paths: &[&'a [&'a str]], name: &str) -> Vec<&'a [&'a str]> {
    let below = paths.iter().filter_map(|path| path.split_first());
    let below = below.filter(|(first, rest)| **first == name && !rest.is_empty());
    below.map(|(_, rest)| rest).collect()
}

/// Default of an element's key: `none` for one that may be left out.
#[must_use]
pub fn element_default(attribute: &str) -> Option<String> {
    (attribute == "default").then(|| "none".to_owned())
}

/// A group whose keys stand in two places of a file: outside `expert:`, and under the stage's
/// `expert:`.
pub trait SplitGroup: Sized {
    type AnalystKeys: DeserializeOwned + Default;
    type Expert: DeserializeOwned + Default;

    fn merge(analyst: Self::AnalystKeys, expert: Self::Expert) -> Self;
    fn keys_of_analyst() -> Vec<Key>;
    fn keys_of_experts() -> Vec<Key>;
}

/// Declares a struct and its `Default` from fields with their defaults.
macro_rules! struct_with_defaults {
    (
        $(#[$about:meta])*
        $visibility:vis struct $name:ident {
            $(
                $(#[$attribute:meta])*
                $field:ident: $type:ty = $default:expr,
            )*
        }
    ) => {
        $(#[$about])*
        $visibility struct $name {
            $(
                $(#[$attribute])*
                pub $field: $type,
            )*
        }

        impl Default for $name {
            fn default() -> $name {
                $name { $($field: $default,)* }
            }
        }
    };
}
pub(crate) use struct_with_defaults;

/// Keys of fields of a struct, with its defaults.
macro_rules! keys_of_fields {
    ($name:ty: $($field:ident: $type:ty, $($doc:literal)+;)*) => {{
        let defaults = <$name>::default();
        let keys: Vec<Vec<$crate::settings::Key>> = vec![
            $($crate::settings::keys_of::<$type>(
                &[stringify!($field)],
                $crate::settings::written_default(&defaults.$field),
                &[$($doc),+],
            )),*
        ];
        keys.concat()
    }};
}
pub(crate) use keys_of_fields;

/// Declares a group of settings. The forms:
///
/// - fields with defaults: a group in sight, or wholly under another group's `expert:`;
/// - the same and `expert { … }`: a stage; `split { … }` lists its groups of the next form;
/// - the same and `split expert { … }`: a group with keys in both places of its stage;
/// - fields without defaults: an element of a map or list. A field with `#[serde(default)]` may be
///   left out.
///
/// `elsewhere { … }` has fields that no key of this group sets: the configuration fills them from
/// another section.
macro_rules! settings {
    (
        $(#[doc = $about:literal])+
        $(#[derive($derive:ident)])?
        pub struct $name:ident {
            $(
                $(#[doc = $doc:literal])+
                $(#[serde($($serde:tt)*)])?
                pub $field:ident: $type:ty = $default:expr,
            )*
        }
        $(
            elsewhere {
                $(
                    $(#[doc = $other_doc:literal])+
                    pub $other:ident: $other_type:ty = $other_default:expr,
                )*
            }
        )?
    ) => {
        $crate::settings::struct_with_defaults! {
            $(#[doc = $about])+
            #[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
            $(#[derive($derive)])?
            #[serde(deny_unknown_fields, default)]
            pub struct $name {
                $(
                    $(#[doc = $doc])+
                    $(#[serde($($serde)*)])?
                    $field: $type = $default,
                )*
                $($(
                    $(#[doc = $other_doc])+
                    #[serde(skip_deserializing)]
                    $other: $other_type = $other_default,
                )*)?
            }
        }

        impl $crate::settings::Setting for $name {
            const IS_GROUP: bool = true;

            fn keys() -> Vec<$crate::settings::Key> {
                $crate::settings::keys_of_fields!($name: $($field: $type, $($doc)+;)*)
            }
        }
    };

    (
        $(#[doc = $about:literal])+
        pub struct $name:ident {
            $(
                $(#[doc = $doc:literal])+
                $(#[serde($($serde:tt)*)])?
                pub $field:ident: $type:ty = $default:expr,
            )*
        }
        expert {
            $(
                $(#[doc = $expert_doc:literal])+
                $(#[serde($($expert_serde:tt)*)])?
                pub $expert:ident: $expert_type:ty = $expert_default:expr,
            )*
        }
        $(
            split {
                $(
                    $(#[doc = $split_doc:literal])+
                    pub $split:ident: $split_type:ty,
                )*
            }
        )?
        $(
            elsewhere {
                $(
                    $(#[doc = $other_doc:literal])+
                    pub $other:ident: $other_type:ty = $other_default:expr,
                )*
            }
        )?
    ) => {
        $crate::settings::struct_with_defaults! {
            $(#[doc = $about])+
            #[derive(Clone, Debug, PartialEq, serde::Serialize)]
            pub struct $name {
                $(
                    $(#[doc = $doc])+
                    $(#[serde($($serde)*)])?
                    $field: $type = $default,
                )*
                $(
                    $(#[doc = $expert_doc])+
                    $(#[serde($($expert_serde)*)])?
                    $expert: $expert_type = $expert_default,
                )*
                $($(
                    $(#[doc = $split_doc])+
                    $split: $split_type = <$split_type>::default(),
                )*)?
                $($(
                    $(#[doc = $other_doc])+
                    $other: $other_type = $other_default,
                )*)?
            }
        }

        const _: () = {
            use $crate::settings::{Key, Setting, below, keys_of_fields, struct_with_defaults};

            struct_with_defaults! {
                #[derive(serde::Deserialize)]
                #[serde(deny_unknown_fields, default)]
                struct Written {
                    $($field: $type = $default,)*
                    $($($split: <$split_type as $crate::settings::SplitGroup>::AnalystKeys = Default::default(),)*)?
                    expert: WrittenExpert = WrittenExpert::default(),
                }
            }

            struct_with_defaults! {
                #[derive(serde::Deserialize)]
                #[serde(deny_unknown_fields, default)]
                struct WrittenExpert {
                    $($expert: $expert_type = $expert_default,)*
                    $($($split: <$split_type as $crate::settings::SplitGroup>::Expert = Default::default(),)*)?
                }
            }

            impl<'de> serde::Deserialize<'de> for $name {
                fn deserialize<D: serde::Deserializer<'de>>(from: D) -> Result<$name, D::Error> {
                    let written = Written::deserialize(from)?;
                    Ok($name {
                        $($field: written.$field,)*
                        $($expert: written.expert.$expert,)*
                        $($($split: $crate::settings::SplitGroup::merge(written.$split, written.expert.$split),)*)?
                        $($($other: $other_default,)*)?
                    })
                }
            }

            impl Setting for $name {
                const IS_GROUP: bool = true;

                fn keys() -> Vec<Key> {
                    [
                        keys_of_fields!($name: $($field: $type, $($doc)+;)*),
                        $($(below(
                            &[stringify!($split)],
                            <$split_type as $crate::settings::SplitGroup>::keys_of_analyst(),
                        ),)*)?
                        below(
                            &["expert"],
                            keys_of_fields!($name: $($expert: $expert_type, $($expert_doc)+;)*),
                        ),
                        $($(below(
                            &["expert", stringify!($split)],
                            <$split_type as $crate::settings::SplitGroup>::keys_of_experts(),
                        ),)*)?
                    ]
                    .concat()
                }
            }
        };
    };

    (
        $(#[doc = $about:literal])+
        pub struct $name:ident {
            $(
                $(#[doc = $doc:literal])+
                pub $field:ident: $type:ty = $default:expr,
            )*
        }
        split expert {
            $(
                $(#[doc = $expert_doc:literal])+
                pub $expert:ident: $expert_type:ty = $expert_default:expr,
            )*
        }
        $(
            elsewhere {
                $(
                    $(#[doc = $other_doc:literal])+
                    pub $other:ident: $other_type:ty = $other_default:expr,
                )*
            }
        )?
    ) => {
        $crate::settings::struct_with_defaults! {
            $(#[doc = $about])+
            #[derive(Clone, Debug, PartialEq, serde::Serialize)]
            pub struct $name {
                $(
                    $(#[doc = $doc])+
                    $field: $type = $default,
                )*
                $(
                    $(#[doc = $expert_doc])+
                    $expert: $expert_type = $expert_default,
                )*
                $($(
                    $(#[doc = $other_doc])+
                    $other: $other_type = $other_default,
                )*)?
            }
        }

        const _: () = {
            use $crate::settings::{Key, SplitGroup, keys_of_fields, struct_with_defaults};

            struct_with_defaults! {
                #[derive(Debug, serde::Deserialize)]
                #[serde(deny_unknown_fields, default)]
                pub struct AnalystKeys {
                    $($field: $type = $default,)*
                }
            }

            struct_with_defaults! {
                #[derive(Debug, serde::Deserialize)]
                #[serde(deny_unknown_fields, default)]
                pub struct Expert {
                    $($expert: $expert_type = $expert_default,)*
                }
            }

            impl SplitGroup for $name {
                type AnalystKeys = AnalystKeys;
                type Expert = Expert;

                fn merge(analyst: AnalystKeys, expert: Expert) -> $name {
                    $name {
                        $($field: analyst.$field,)*
                        $($expert: expert.$expert,)*
                        $($($other: $other_default,)*)?
                    }
                }

                fn keys_of_analyst() -> Vec<Key> {
                    keys_of_fields!($name: $($field: $type, $($doc)+;)*)
                }

                fn keys_of_experts() -> Vec<Key> {
                    keys_of_fields!($name: $($expert: $expert_type, $($expert_doc)+;)*)
                }
            }
        };
    };

    (
        $(#[doc = $about:literal])+
        pub struct $name:ident {
            $(
                $(#[doc = $doc:literal])+
                $(#[serde($serde:tt)])?
                pub $field:ident: $type:ty,
            )*
        }
    ) => {
        $(#[doc = $about])+
        #[derive(Clone, Debug, Default, PartialEq, serde::Serialize, serde::Deserialize)]
        #[serde(deny_unknown_fields)]
        pub struct $name {
            $(
                $(#[doc = $doc])+
                $(#[serde($serde)])?
                pub $field: $type,
            )*
        }

        impl $crate::settings::Setting for $name {
            const IS_GROUP: bool = true;

            fn keys() -> Vec<$crate::settings::Key> {
                [
                    $($crate::settings::keys_of::<$type>(
                        &[stringify!($field)],
                        $crate::settings::element_default(concat!("" $(, stringify!($serde))?)),
                        &[$($doc),+],
                    )),*
                ]
                .concat()
            }
        }
    };
}
pub(crate) use settings;
