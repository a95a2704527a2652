"""Volume meshes of any program: kinds of elements, proofs of det J > 0, and of elements that do not overlap."""
