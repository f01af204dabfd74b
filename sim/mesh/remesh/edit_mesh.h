#pragma once

#include <array>
#include <cstddef>
#include <functional>
#include <vector>

#include "sim/mesh/triangle_mesh.h"

namespace touchfield {

inline std::size_t at(Eigen::Index i) { return static_cast<std::size_t>(i); }

/// Half-edges of a closed oriented manifold whose connectivity changes. Sides 3 f, 3 f + 1, 3 f + 2 go round face f.
/// Knows no geometry. Vertices and faces that are removed leave a gap in the numbering until `compact`.
///
/// Every edge carries a label >= 0 or kNoLabel, which follows the edge. Both halves of a split edge have its label. New
/// edges have none. Where a collapse merges two edges, the larger label stays.
class EditMesh {
 public:
  static constexpr int kNoLabel = -1;

  /// throws   InputError if an edge does not have exactly two faces that run opposite ways
  EditMesh(const Triangles& triangles, Eigen::Index vertex_count);

  int side_count() const { return static_cast<int>(from_.size()); }
  int vertex_count() const { return static_cast<int>(outgoing_.size()); }
  bool alive(int side) const { return from_[at(side)] >= 0; }
  bool vertex_alive(int vertex) const { return outgoing_[at(vertex)] >= 0; }

  static int next(int side) { return side % 3 == 2 ? side - 2 : side + 1; }
  static int previous(int side) { return side % 3 == 0 ? side + 2 : side - 1; }
  int opposite(int side) const { return opposite_[at(side)]; }
  int from(int side) const { return from_[at(side)]; }
  int to(int side) const { return from(next(side)); }
  /// The corner of its face that is not on a side.
  int apex(int side) const { return from(previous(side)); }
  std::array<int, 3> corners(int side) const { return {from(side), to(side), apex(side)}; }
  /// Start and end of an edge, and the corners opposite to it.
  std::array<int, 4> corners_about(int side) const { return {from(side), to(side), apex(side), apex(opposite(side))}; }
  int valence(int vertex) const { return valence_[at(vertex)]; }

  int label(int side) const { return labels_[at(side)]; }
  void set_label(int side, int label) { labels_[at(side)] = labels_[at(opposite(side))] = label; }

  /// The side that runs from a to b, -1 if they are no neighbours.
  int side_between(int a, int b) const;

  /// The sides that leave one vertex, in clockwise order; none if the vertex is gone.
  class Around {
   public:
    struct Iterator {
      const EditMesh& mesh;
      int first;
      int side;  // -1 at the end

      int operator*() const { return side; }
      bool operator!=(const Iterator& other) const { return side != other.side; }
      Iterator& operator++() {
        const int next = mesh.next_around(side);
        side = next == first ? -1 : next;
        return *this;
      }
    };
    Around(const EditMesh& mesh, int first) : mesh_(mesh), first_(first) {}
    Around(const EditMesh&&, int) = delete;
    Iterator begin() const { return {mesh_, first_, first_}; }
    Iterator end() const { return {mesh_, first_, -1}; }

   private:
    const EditMesh& mesh_;
    int first_;
  };
  Around around(int vertex) const& { return {*this, outgoing_[at(vertex)]}; }
  Around around(int vertex) const&& = delete;

  /// Puts a new vertex on the side's edge; returns its number. The side keeps its start.
  int split(int side);

  /// Whether moving the side's start into its end keeps the surface a manifold (link condition).
  bool can_collapse(int side) const;
  void collapse(int side);

  /// Whether the edge can be exchanged for the other diagonal of its two faces.
  bool can_flip(int side) const;
  void flip(int side);

  /// The triangles that are left, and the numbers that their vertices had.
  Triangles compact(std::vector<int>& old_numbers) const;

 private:
  int next_around(int side) const { return opposite(previous(side)); }
  bool adjacent(int a, int b) const { return side_between(a, b) >= 0; }
  void join(int side, int other);
  int add_face(int a, int b, int c);

  std::vector<int> from_;      // start of each side, -1 if its face is gone
  std::vector<int> opposite_;  // the same edge seen from the other face
  std::vector<int> outgoing_;  // one side that leaves each vertex, -1 if the vertex is gone
  std::vector<int> valence_;
  std::vector<int> labels_;  // of each side's edge
};

struct FlatFaces {
  Eigen::Index removed = 0;
  Vector3 first = Vector3::Zero();  // a corner of the first [m]
};

/// Removes faces with next to no area. The shortest edge of a needle is at most a thousandth of its longest, and is
/// collapsed. Other faces are removed by a flip of their longest edge, where that leaves two faces with area. So are
/// needles that cannot be collapsed. Faces that neither removes stay.
///
/// points   of the mesh's vertices
/// least    area over the longest edge squared; a face below is flat
FlatFaces remove_flat_faces(EditMesh& mesh, const Points& points, double least);

/// The same surface without splinters: faces so thin that their normals mean nothing. Edges shorter than `thinnest` are
/// collapsed into one of their ends. The longest edge of a face is flipped if the face's height over it is less than
/// `thinnest`. Thicker faces turn by at most 10 degrees at a time, and nothing moves by more than `thinnest`. Splinters
/// that cannot be removed in this way stay.
///
/// mesh       closed, manifold, oriented
/// thinnest   [m] at points
/// returns    a mesh on some of the vertices, closed and of the same genus
TriangleMesh without_splinters(const TriangleMesh& mesh, const std::function<Eigen::VectorXd(const Points&)>& thinnest);

}  // namespace touchfield
