#pragma once

#include <Eigen/Dense>
#include <array>
#include <string>
#include <vector>

namespace youbot_base_sim {

/// A surface of quadrilaterals with a normal at each vertex, so that it is shaded as a smooth one.
class Mesh {
 public:
  struct Vertex {
    Eigen::Vector3d position;  ///< m
    Eigen::Vector3d normal;    ///< of length 1, outward
  };

  /// Adds a sheet of rows x columns vertices, vertex(row, column), that are joined to their neighbours. Rows or columns
  /// may coincide, as in the middle of a disc.
  template <class MakeVertex>
  void add_sheet(int rows, int columns, const MakeVertex& vertex) {
    const int first = static_cast<int>(vertices_.size());
    for (int row = 0; row < rows; ++row) {
      for (int column = 0; column < columns; ++column) vertices_.push_back(vertex(row, column));
    }
    for (int row = 0; row + 1 < rows; ++row) {
      for (int column = 0; column + 1 < columns; ++column) {
        const int corner = first + row * columns + column;
        add_face({corner, corner + 1, corner + columns + 1, corner + columns});
      }
    }
  }

  /// As a Wavefront OBJ file.
  std::string obj() const;

 private:
  using Face = std::array<int, 4>;

  void add_face(Face face);

  std::vector<Vertex> vertices_;
  std::vector<Face> faces_;
};

}  // namespace youbot_base_sim
