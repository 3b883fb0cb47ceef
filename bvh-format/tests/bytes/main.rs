//! The bytes: frozen files of every rule, and the tables of the specification.

mod golden;
mod spec_tables;
