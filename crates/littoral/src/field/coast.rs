//! The built-in coast: an invented headland, a bay with a beach, hills behind, sea bed in front.
