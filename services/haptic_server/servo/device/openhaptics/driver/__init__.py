"""The vendor's HD library: loading, calls, names, faults and diagnosis."""
