"""Pictures of meshes through VTK: by software alone, without a display."""
