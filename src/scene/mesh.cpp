#include "mesh.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <iterator>

namespace youbot_base_sim {

namespace {

/// Six digits: a ten-millionth of a metre on a robot of a metre. What is below a nanometre is a rounding error.
double rounded(double x) { return std::abs(x) < 1e-9 ? 0.0 : x; }

void write(std::string& text, const char* what, const Eigen::Vector3d& v) {
  fmt::format_to(std::back_inserter(text), "{} {:.6g} {:.6g} {:.6g}\n", what, rounded(v.x()), rounded(v.y()),
                 rounded(v.z()));
}

}  // namespace

/// Turns the face so that its corners go counter-clockwise for whoever looks at its outside.
void Mesh::add_face(Face face) {
  const auto at = [&](int k) { return vertices_[face[k]]; };
  const Eigen::Vector3d turn = (at(2).position - at(0).position).cross(at(3).position - at(1).position);
  if (turn.dot(at(0).normal + at(1).normal + at(2).normal + at(3).normal) < 0) std::reverse(face.begin(), face.end());
  faces_.push_back(face);
}

std::string Mesh::obj() const {
  std::string text = "# Written by describe_base. m\n";
  for (const Vertex& vertex : vertices_) write(text, "v", vertex.position);
  for (const Vertex& vertex : vertices_) write(text, "vn", vertex.normal);
  for (const Face& face : faces_) {
    text += "f";
    for (const int k : face) fmt::format_to(std::back_inserter(text), " {0}//{0}", k + 1);
    text += "\n";
  }
  return text;
}

}  // namespace youbot_base_sim
