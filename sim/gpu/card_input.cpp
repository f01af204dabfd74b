#include "sim/gpu/card_input.h"

namespace touchfield {

GpuSources card_sources(const TransducerArray& array, const Eigen::VectorXcd& response) {
  GpuSources sources;
  sources.plane_wave = array.kind == TransducerArray::Kind::kPlaneWave;
  sources.count = static_cast<int>(array.size());
  sources.positions = array.positions.data();
  sources.axes = array.axes.data();
  sources.amplitudes = array.amplitudes.data();
  sources.response = array.response.as_designed() ? nullptr : response.data();
  sources.spline = array.directivity.spline();
  sources.intervals = Directivity::kIntervals;
  sources.interval = Directivity::kInterval;
  sources.piston_ka = array.directivity.ka();
  return sources;
}

GpuBodySpec card_surface(const TriangleMesh& mesh, const Wave& wave) {
  GpuBodySpec spec;
  spec.vertices = mesh.vertices().data();
  spec.vertex_count = static_cast<int>(mesh.vertex_count());
  spec.triangles = mesh.triangles().data();
  spec.faces = static_cast<int>(mesh.face_count());
  spec.k = wave.k();
  spec.alpha = wave.wavenumber().imag();
  return spec;
}

}  // namespace touchfield
