//! Charts: what is drawn, and how much of it.
