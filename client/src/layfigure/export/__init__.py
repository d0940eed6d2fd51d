"""Takes for tools that read no USD: glTF through pygltflib, and BVH."""
