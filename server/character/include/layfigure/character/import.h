#pragma once

#include <filesystem>
#include <stdexcept>

#include "layfigure/cache/disk_cache.h"
#include "layfigure/character/rig.h"

namespace layfigure::character {

/// A character's file that cannot be used. what() is one line that names the file, what is wrong and the mend.
class ImportError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// Reads a rigged character from any format that assimp reads with its bones: glTF, FBX, Collada, X, MD5, SMD, MDL,
/// B3D, MS3D, Ogre XML and others (Debian's assimp 5.2 lacks M3D, and reads no skeleton of an IQM).
///
/// Axes and units. glTF is in metres, Y up. Of an FBX the unit and the up axis come from its metadata, of a Collada
/// file from its header. The other formats have no unit: SMD, MDL and MD5 are taken as inches, all others as metres;
/// SMD is taken as Z up, all others as Y up, into which most of assimp's readers turn their format. If the character's
/// longest side is not 0.1 to 10 m then (0.03 to 100 m where the file states its unit), it is taken to be in the first
/// of metres, centimetres and millimetres that makes it so; whatever was not stated is a warning. The rig is in the
/// world's axes (Z up), metres; scales are multiplied into the vertices and the bones' positions, so that every bone is
/// rigid.
///
/// Bones. The skin's joints; the nodes between them; the nearest node that joins them all, if they have several roots
/// (so a rig that is read from a file has one root); and the empty nodes below a joint, which end its chain. Helper
/// nodes ($AssimpFbx$) and the nodes above the root are folded into the poses of the others. bind is the inverse of the
/// skin's own bind matrix where the skin names the bone, else its node's pose beside its parent; rest is that same
/// pose, X_PB = X_WP^-1 X_WB of the binds, whatever pose the nodes were saved in: a doll starts undeformed. Names are
/// made unique, non-empty, UTF-8 and free of control characters; where nodes share a name, the skin means the first of
/// them that holds no mesh. A bone that only the skin knows hangs on the joint nearest to it. Of the formats that are
/// read, FBX alone states limits for the joints of a skeleton, which become Bone::limits.
///
/// Meshes. Triangulated; vertices of equal position and weights are joined; weights are normalised, those below 1e-6
/// dropped; a mesh without weights that hangs on a bone follows it rigidly, and one that hangs on none is left out;
/// winding is mended if the whole is inside out. Normals and texture coordinates are those of the file, of the set that
/// the base colour texture goes by; joined vertices keep those that differ as wedges. A glTF skin without bind
/// matrices, whose vertices are in the frames of its joints, is bound as the file poses it. Whatever was mended or left
/// out is a line in Rig::warnings.
///
/// Looks. Of materials the base colour, the opacity and the base colour texture are kept. A texture's file is named,
/// not looked at; a picture in the character's file is kept as it is, up to kMostImageBytes. Vertex colours and
/// transforms of textures are left out.
///
/// Files. Those that the character's file names (buffers, lists of materials, a skeleton) are looked for in its folder
/// and below only; links and paths that lead elsewhere find nothing. With a `cache`, a rig that was read before is
/// taken from there, if all of those files have the bytes that they had.
///
/// Throws ImportError: no such file, not a file, empty, truncated, not a format that is known, broken, without mesh,
/// bones or triangles, numbers that are not finite or above 1e6 m, sizes above 4 GB, 16 384 bones or 20 million
/// vertices, more than 4 GB of memory or a second of CPU time for each 4 MB and 20 s beyond that. Whatever a broken
/// file does to assimp, nothing else happens: it is read in a child process (isolate.h), so call this before there are
/// threads that hold locks. O(file).
[[nodiscard]] Rig import_rig(const std::filesystem::path& path, const cache::DiskCache& cache = {});

}  // namespace layfigure::character
