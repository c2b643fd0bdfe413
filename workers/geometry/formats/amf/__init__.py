"""AMF, plain or zipped."""
