//! Enums whose variants are the words of a column, each declared once with its meaning.

/// A word that a column may hold.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Entry {
    pub word: &'static str,
    pub meaning: &'static str,
}

/// An enum declared with [`words!`].
pub trait Words {
    /// Words in the order of declaration; free text stands last as `…`.
    const ENTRIES: &'static [Entry];

    /// The word in the files.
    fn word(&self) -> &str;
}

/// Declares an enum whose variants are words of a file, with the meaning of each as its doc
/// comment:
///
/// ```ignore
/// words! {
///     /// Verdict on a channel.
///     pub enum ChannelVerdict {
///         /// A relation between channels confirms it.
///         Ok = "ok",
///     }
///     or text {
///         /// The fault.
///         Fault
///     }
/// }
/// ```
///
/// The enum displays, serialises and deserialises as its words. Without `or text` it is `Copy`,
/// has `name()` and `from_word()`, and no other word deserialises; with it, any other text is the
/// last variant. `pub enum Name default Variant { … }` implements `Default`.
macro_rules! words {
    (
        $(#[$meta:meta])*
        $vis:vis enum $name:ident $(default $default:ident)? {
            $($(#[doc = $meaning:literal])+ $variant:ident = $word:literal,)+
        }
    ) => {
        $(#[$meta])*
        #[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
        $vis enum $name {
            $($(#[doc = $meaning])+ $variant,)+
        }

        impl $name {
            /// Every variant in the order of declaration.
            pub const ALL: [Self; [$($word),+].len()] = [$(Self::$variant),+];

            /// The word in the files.
            #[must_use]
            pub const fn name(self) -> &'static str {
                match self {
                    $(Self::$variant => $word,)+
                }
            }

            /// Variant of a word; `None` for another word.
            #[must_use]
            pub fn from_word(word: &str) -> Option<Self> {
                match word {
                    $($word => Some(Self::$variant),)+
                    _ => None,
                }
            }
        }

        $(impl Default for $name {
            fn default() -> Self {
                Self::$default
            }
        })?

        impl $crate::schema::Words for $name {
            const ENTRIES: &'static [$crate::schema::Entry] = &[
                $($crate::schema::Entry { word: $word, meaning: concat!($($meaning),+) },)+
            ];

            fn word(&self) -> &str {
                self.name()
            }
        }

        impl<'de> serde::Deserialize<'de> for $name {
            fn deserialize<D: serde::Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
                struct Visitor;

                impl serde::de::Visitor<'_> for Visitor {
                    type Value = $name;

                    fn expecting(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
                        f.write_str([$($word),+].join(", ").as_str())
                    }

                    fn visit_str<E: serde::de::Error>(self, word: &str) -> Result<$name, E> {
                        $name::from_word(word)
                            .ok_or_else(|| E::unknown_variant(word, &[$($word),+]))
                    }
                }

                deserializer.deserialize_str(Visitor)
            }
        }

        $crate::schema::words!(@write $name);
    };
    (
        $(#[$meta:meta])*
        $vis:vis enum $name:ident {
            $($(#[doc = $meaning:literal])+ $variant:ident = $word:literal,)+
        }
        or text {
            $(#[doc = $free_meaning:literal])+ $free:ident
        }
    ) => {
        $(#[$meta])*
        #[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
        $vis enum $name {
            $($(#[doc = $meaning])+ $variant,)+
            $(#[doc = $free_meaning])+ $free(String),
        }

        impl $crate::schema::Words for $name {
            const ENTRIES: &'static [$crate::schema::Entry] = &[
                $($crate::schema::Entry { word: $word, meaning: concat!($($meaning),+) },)+
                $crate::schema::Entry { word: "…", meaning: concat!($($free_meaning),+) },
            ];

            fn word(&self) -> &str {
                match self {
                    $(Self::$variant => $word,)+
                    Self::$free(text) => text,
                }
            }
        }

        impl<'de> serde::Deserialize<'de> for $name {
            fn deserialize<D: serde::Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
                let word = <String as serde::Deserialize>::deserialize(deserializer)?;
                Ok(match &*word {
                    $($word => Self::$variant,)+
                    _ => Self::$free(word),
                })
            }
        }

        $crate::schema::words!(@write $name);
    };
    (@write $name:ident) => {
        impl std::fmt::Display for $name {
            fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
                f.pad($crate::schema::Words::word(self))
            }
        }

        impl serde::Serialize for $name {
            fn serialize<S: serde::Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
                serializer.serialize_str($crate::schema::Words::word(self))
            }
        }
    };
}

pub(crate) use words;

#[cfg(test)]
mod tests {
    use super::*;

    words! {
        /// A set for the test.
        enum Closed {
            /// The first.
            First = "first of all",
            /// The second, which takes
            /// two lines.
            Second = "second",
        }
    }

    words! {
        /// A set with free text.
        enum Open {
            /// Nothing is wrong.
            Ok = "ok",
        }
        or text {
            /// The fault.
            Fault
        }
    }

    #[test]
    fn a_word_is_read_back_as_its_variant_and_another_is_refused() {
        for variant in Closed::ALL {
            let text = serde_json::to_string(&variant).unwrap();
            assert_eq!(text, format!("\"{variant}\""));
            assert_eq!(serde_json::from_str::<Closed>(&text).unwrap(), variant);
        }
        let refused = serde_json::from_str::<Closed>("\"third\"").unwrap_err();
        assert!(refused.to_string().contains("`third`"), "{refused}");
        assert_eq!(
            Closed::ENTRIES[1].meaning,
            " The second, which takes two lines."
        );
    }

    #[test]
    fn any_other_text_is_the_free_variant() {
        let read = |text: &str| serde_json::from_str::<Open>(text).unwrap();
        assert_eq!(read("\"ok\""), Open::Ok);
        assert_eq!(read("\"stuck\""), Open::Fault("stuck".to_owned()));
        assert_eq!(
            format!("{:>4}|{}", Open::Ok, read("\"stuck\"")),
            "  ok|stuck"
        );
        let words: Vec<&str> = Open::ENTRIES.iter().map(|entry| entry.word).collect();
        assert_eq!(words, ["ok", "…"]);
    }
}
