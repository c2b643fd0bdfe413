"""Pictures of meshes: shaded or coloured by a function, as PNG."""
