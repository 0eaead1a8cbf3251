"""Elements in the equations of a mechanism, one file each: forces, constraint and limits of every state as rows."""
