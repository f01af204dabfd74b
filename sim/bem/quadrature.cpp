#include "sim/bem/quadrature.h"

#include <algorithm>
#include <array>

#include <Eigen/Geometry>

#include "sim/bem/polynomials.h"
#include "sim/mesh/face_shape.h"

namespace touchfield {

namespace {

struct TrianglePoint {
  double weight;  // of the triangle's area
  double u;
  double v;  // barycentric coordinates of corners b and c
};

/// Radon's 7-point rule, exact for polynomials of degree 5.
const std::array<TrianglePoint, 7>& radon_rule() {
  static const std::array<TrianglePoint, 7> rule = [] {
    const double root = std::sqrt(15.0);
    const double w1 = (155.0 - root) / 1200.0;
    const double w2 = (155.0 + root) / 1200.0;
    const double s1 = (6.0 - root) / 21.0;
    const double s2 = (6.0 + root) / 21.0;
    return std::array<TrianglePoint, 7>{{{9.0 / 40.0, 1.0 / 3.0, 1.0 / 3.0},
                                         {w1, s1, s1},
                                         {w1, 1.0 - 2.0 * s1, s1},
                                         {w1, s1, 1.0 - 2.0 * s1},
                                         {w2, s2, s2},
                                         {w2, 1.0 - 2.0 * s2, s2},
                                         {w2, s2, 1.0 - 2.0 * s2}}};
  }();
  return rule;
}

/// Strang and Fix's 3-point rule with inner points, exact for degree 2.
const std::array<TrianglePoint, 3>& strang_rule() {
  static const std::array<TrianglePoint, 3> rule = {
      {{1.0 / 3.0, 1.0 / 6.0, 1.0 / 6.0}, {1.0 / 3.0, 2.0 / 3.0, 1.0 / 6.0}, {1.0 / 3.0, 1.0 / 6.0, 2.0 / 3.0}}};
  return rule;
}

constexpr int kDeepest = 12;  // halvings of a face: a point a 4000th of an edge off it

}  // namespace

double solid_angle(const Face& face, const Vector3& x) {
  return -solid_angle(Vector3(face.a - x), Vector3(face.b - x), Vector3(face.c - x));
}

Vector3 solid_angle_gradient(const Face& face, const Vector3& x) {
  const auto edge = [&](const Vector3& from, const Vector3& to) -> Vector3 {
    const Vector3 a = from - x;
    const Vector3 b = to - x;
    const double la = a.norm();
    const double lb = b.norm();
    return (la + lb) / (la * lb * (la * lb + a.dot(b))) * a.cross(b);
  };
  return -(edge(face.a, face.b) + edge(face.b, face.c) + edge(face.c, face.a));
}

FaceQuadrature::FaceQuadrature(const Complex& wavenumber, double gamma, const FaceRule& rule)
    : scale_(wavenumber.real() / std::numbers::pi), rule_(rule) {
  constants_.damping = std::numbers::pi * wavenumber.imag() / wavenumber.real();
  constants_.gamma = gamma * scale_;
}

void FaceQuadrature::begin(const Vector3& x, const Vector3& m) {
  x_ = x;
  m_ = m;
  for (auto* values : {&px_, &py_, &pz_, &nx_, &ny_, &nz_, &weight_}) {
    values->clear();
  }
  ends_.clear();
  close_.clear();
  close_index_.clear();
}

void FaceQuadrature::add_point(const Vector3& y, const Vector3& n, double weight) {
  const Vector3 offset = scale_ * (y - x_);  // seen from x: what is near keeps all its digits
  px_.push_back(offset.x());
  py_.push_back(offset.y());
  pz_.push_back(offset.z());
  nx_.push_back(n.x());
  ny_.push_back(n.y());
  nz_.push_back(n.z());
  weight_.push_back(weight * scale_ * scale_ / (4.0 * std::numbers::pi));
}

void FaceQuadrature::add_piece(const Vector3& a, const Vector3& b, const Vector3& c, const Vector3& n, double area,
                               int depth) {
  const double distance2 = (x_ - (a + b + c) / 3.0).squaredNorm();
  if (distance2 < rule_.split_ratio * rule_.split_ratio * area && depth < kDeepest) {
    const Vector3 ab = 0.5 * (a + b);
    const Vector3 bc = 0.5 * (b + c);
    const Vector3 ca = 0.5 * (c + a);
    add_piece(a, ab, ca, n, 0.25 * area, depth + 1);
    add_piece(ab, b, bc, n, 0.25 * area, depth + 1);
    add_piece(ca, bc, c, n, 0.25 * area, depth + 1);
    add_piece(ab, bc, ca, n, 0.25 * area, depth + 1);
    return;
  }
  for (const TrianglePoint& q : radon_rule()) {
    add_point(a + q.u * (b - a) + q.v * (c - a), n, q.weight * area);
  }
}

void FaceQuadrature::add(const Face& face) {
  const Vector3 centroid = (face.a + face.b + face.c) / 3.0;
  const double size = std::sqrt(face.area);
  const double distance = (x_ - centroid).norm();
  if (distance < rule_.seven_below * size) {
    close_.push_back(face);
    close_index_.push_back(ends_.size());
    add_piece(face.a, face.b, face.c, face.normal, face.area, 0);
  } else if (distance < rule_.three_below * size) {
    for (const TrianglePoint& q : strang_rule()) {
      add_point(face.a + q.u * (face.b - face.a) + q.v * (face.c - face.a), face.normal, q.weight * face.area);
    }
  } else {
    add_point(centroid, face.normal, face.area);
  }
  ends_.push_back(weight_.size());
}

const std::vector<Complex>& FaceQuadrature::integrals(Layer layer) {
  re_.resize(weight_.size());
  im_.resize(weight_.size());
  const PairPoint<double> origin{0.0, 0.0, 0.0, m_.x(), m_.y(), m_.z()};
  pair_loops_of<double>().values(layer, constants_, origin,
                                 {px_.data(), py_.data(), pz_.data(), nx_.data(), ny_.data(), nz_.data()},
                                 static_cast<int>(weight_.size()), re_.data(), im_.data());
  const double unit = layer == Layer::kSingle || layer == Layer::kSingleAdjoint ? 1.0 / scale_ : 1.0;
  values_.resize(ends_.size());
  std::size_t q = 0;
  for (std::size_t f = 0; f < ends_.size(); ++f) {
    double re = 0.0;
    double im = 0.0;
    for (; q < ends_[f]; ++q) {
      re += weight_[q] * re_[q];
      im += weight_[q] * im_[q];
    }
    values_[f] = unit * Complex(re, im);
  }
  if (layer != Layer::kSingle && layer != Layer::kSingleAdjoint) {
    make_static_exact(layer);
  }
  return values_;
}

void FaceQuadrature::make_static_exact(Layer layer) {
  const PairPoint<double> origin{0.0, 0.0, 0.0, m_.x(), m_.y(), m_.z()};
  const bool adjoint = layer == Layer::kAdjoint || layer == Layer::kAdjointMiller;
  const bool miller = layer == Layer::kBurtonMiller || layer == Layer::kAdjointMiller;
  const double gamma = miller ? constants_.gamma / scale_ : 0.0;  // [m]
  for (std::size_t c = 0; c < close_.size(); ++c) {
    const Face& face = close_[c];
    const std::size_t f = close_index_[c];
    const std::size_t begin = f == 0 ? 0 : ends_[f - 1];
    const std::size_t count = ends_[f] - begin;
    pair_loops().static_values(layer, constants_.gamma, origin,
                               {px_.data() + begin, py_.data() + begin, pz_.data() + begin, nx_.data() + begin,
                                ny_.data() + begin, nz_.data() + begin},
                               static_cast<int>(count), re_.data() + begin, im_.data() + begin);
    double re = 0.0;
    double im = 0.0;
    for (std::size_t q = begin; q < ends_[f]; ++q) {
      re += weight_[q] * re_[q];
      im += weight_[q] * im_[q];
    }
    // D0 = Omega / 4 pi, W0 = m . grad D0; the adjoint's static part int dg0/dn_x dS is no such loop and stays.
    const double hypersingular = miller ? m_.dot(solid_angle_gradient(face, x_)) / (4.0 * std::numbers::pi) : 0.0;
    const double plain = adjoint ? re : solid_angle(face, x_) / (4.0 * std::numbers::pi);
    values_[f] += Complex(plain - re, gamma * hypersingular - im);
  }
}

SelfIntegrals self_integrals(const Face& face, const Complex& wavenumber) {
  const Vector3 centre = (face.a + face.b + face.c) / 3.0;
  const std::array<Vector3, 3> corners = {face.a - centre, face.b - centre, face.c - centre};
  const Complex ik = Complex(0, 1) * wavenumber;
  Complex waves = 0;   // loop of exp(ikR) dt
  Complex finite = 0;  // loop of (ik - exp(ikR)/R) dt
  for (std::size_t e = 0; e < 3; ++e) {
    const Vector3& a = corners[e];
    const Vector3& b = corners[(e + 1) % 3];
    const Vector3 along = (b - a).normalized();
    const double h = (a - along.dot(a) * along).norm();
    const double from = std::asinh(along.dot(a) / h);
    const double to = std::asinh(along.dot(b) / h);
    const double middle = 0.5 * (from + to);
    const double half = 0.5 * (to - from);
    for (std::size_t q = 0; q < kGaussNode.size(); ++q) {
      for (const double side : {-1.0, 1.0}) {
        const double lengthening = std::cosh(middle + side * half * kGaussNode[q]);
        const double radius = h * lengthening;
        const Complex rest = std::exp(ik * radius) - 1.0;
        const double weight = half * kGaussWeight[q] / lengthening;
        waves += weight * rest;
        finite -= weight * (rest - ik * radius) / radius;
      }
    }
    finite -= (std::tanh(to) - std::tanh(from)) / h;
  }
  return {Complex(0, -0.5) / wavenumber * (waves / (2.0 * std::numbers::pi)), finite / (4.0 * std::numbers::pi)};
}

Face face_of(const TriangleMesh& mesh, Eigen::Index f) {
  return {mesh.corner(f, 0), mesh.corner(f, 1), mesh.corner(f, 2), mesh.normals().col(f), mesh.areas()(f)};
}

}  // namespace touchfield
