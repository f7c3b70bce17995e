//! Flight paths: points above ground or absolute, and the curves through them.
