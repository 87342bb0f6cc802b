#pragma once

#include <Eigen/Dense>
#include <array>
#include <string>
#include <vector>

namespace youbot_base_sim {

/// Red, green, blue, 0 .. 1.
using Colour = std::array<double, 3>;

/// A painted surface of quadrilaterals with a normal at each vertex, so that it is shaded as a smooth one.
class Mesh {
 public:
  struct Vertex {
    Eigen::Vector3d position;  ///< m
    Eigen::Vector3d normal;    ///< of length 1, outward
  };

  /// Adds a sheet of rows x columns vertices, vertex(row, column), that are joined to their neighbours. Rows or columns
  /// may coincide, as in the middle of a disc.
  template <class MakeVertex>
  void add_sheet(const Colour& colour, int rows, int columns, const MakeVertex& vertex) {
    const int first = static_cast<int>(positions_.size());
    for (int row = 0; row < rows; ++row) {
      for (int column = 0; column < columns; ++column) {
        const Vertex one = vertex(row, column);
        positions_.push_back(one.position);
        normals_.push_back(one.normal);
      }
    }
    for (int row = 0; row + 1 < rows; ++row) {
      for (int column = 0; column + 1 < columns; ++column) {
        const int corner = first + row * columns + column;
        add_face(colour, {corner, corner + 1, corner + columns + 1, corner + columns});
      }
    }
  }

  /// As a COLLADA file.
  std::string collada() const;

 private:
  struct Paint {
    Colour colour;
    std::vector<std::array<int, 3>> triangles;
  };

  void add_face(const Colour& colour, std::array<int, 4> face);
  void add_triangle(const Colour& colour, const std::array<int, 3>& triangle);

  std::vector<Eigen::Vector3d> positions_, normals_;
  std::vector<Paint> paints_;
};

}  // namespace youbot_base_sim
