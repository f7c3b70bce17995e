//! Pictures without a GPU: the reference that every other renderer is held against.
