//! Simulated servo buses that speak the same bytes as real ones.
