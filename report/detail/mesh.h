#pragma once
#include <array>
#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

/// The meshes that a URDF's <visual> names, as triangles for the playback.
namespace porthos::report {

struct Mesh {
  std::vector<std::array<double, 3>> corners;           ///< [m], in the axes of the file
  std::vector<std::array<std::uint32_t, 3>> triangles;  ///< indices of corners
};

/// The least coordinates of a mesh and the longest side of its box [m].
struct Extent {
  std::array<double, 3> low;
  double longest;
};
/// @param mesh  with a corner
Extent extent_of(const Mesh& mesh);

/// Reads an STL (binary or text), OBJ or COLLADA (.dae) file; polygons become fans of triangles.
/// Materials, textures and normals are passed over. Of COLLADA the unit and the transformations of
/// the scene's nodes are applied, up_axis is not, as RViz does.
/// @param file  its ending, in any case, tells the format; the name is used in messages
/// @throws InvalidArgument "<file>: ..." if the content is no such mesh, names a corner that is not
///   there, has a number that is not finite or no triangle
Mesh parse_mesh(const std::string& bytes, const std::filesystem::path& file);
/// Reads a file of at most 256 MB. @throws InvalidArgument likewise, or if it cannot be read
Mesh read_mesh(const std::filesystem::path& file);

/// The same shape with at most `most` triangles: corners in one cell of a grid become their mean,
/// triangles within less than three cells vanish. Source: Rossignac, Borrel 1993 ("Multi-resolution
/// 3D approximations", section 3). Cost: linear, for each of at most 8 grids.
/// @return the mesh itself if it has no more; never with more than 65535 corners
Mesh simplified(Mesh mesh, std::size_t most);

/// The file that a URDF means by a name: beside the model file, an absolute path or file://, or
/// package://NAME/REST as NAME/REST beside a folder above the model file or in a folder of
/// ROS_PACKAGE_PATH. @param folders  those of the model files. Empty: there is none.
std::filesystem::path mesh_file(const std::string& name,
                                const std::vector<std::filesystem::path>& folders);

/// COLLADA, see parse_mesh().
Mesh parse_collada(const std::string& bytes, const std::string& file);

}  // namespace porthos::report
