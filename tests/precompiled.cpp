// Only there for what is compiled with it: precompiled.h.
