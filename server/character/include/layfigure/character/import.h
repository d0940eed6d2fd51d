#pragma once

#include <filesystem>
#include <stdexcept>

#include "layfigure/character/rig.h"

namespace layfigure::character {

/// A character's file that cannot be used. what() is one line that names the file, what is wrong and the mend.
class ImportError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// Reads a rigged character from any format that assimp reads (glTF, FBX, Collada, X, ...).
///
/// Axes and units. glTF is in metres, Y up. Of an FBX the units and the up axis come from its metadata; other formats
/// are taken as Y up and in metres unless assimp converts them itself. The rig is in the world's axes (Z up), metres;
/// scales are multiplied into the vertices and the bones' positions, so that every bone is rigid.
///
/// Bones. The skin's joints; the nodes between them; the nearest node that joins them all, if they have several roots
/// (so a rig that is read from a file has one root); and the empty nodes below a joint, which end its chain. Helper
/// nodes
/// ($AssimpFbx$) and the nodes above the root are folded into the poses of the others. bind is the inverse of the
/// skin's own bind matrix where the skin names the bone, else its node's pose beside its parent; rest is that same
/// pose, X_PB = X_WP^-1 X_WB of the binds, whatever pose the nodes were saved in: a doll starts undeformed. Names are
/// made unique and non-empty.
///
/// Meshes. Triangulated; vertices of equal position and weights are joined; weights are normalised, those below 1e-6
/// dropped; a mesh without weights that hangs on a bone follows it rigidly, and one that hangs on none is left out;
/// winding is mended if the whole is inside out. Whatever was mended or left out is a line in Rig::warnings.
///
/// Throws ImportError: no such file, not a file, empty, truncated, not a format that is known, broken, without bones or
/// triangles, numbers that are not finite or above 1e6 m, sizes above 4 GB, 16 384 bones or 20 million vertices.
/// Whatever a broken file does to assimp, nothing else happens: it is read in a child process (isolate.h), so call this
/// before there are threads that hold locks. O(file); reads a body of 13 000 vertices in 30 ms.
[[nodiscard]] Rig import_rig(const std::filesystem::path& path);

}  // namespace layfigure::character
