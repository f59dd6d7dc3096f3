#pragma once

#include <memory>
#include <vector>

#include "lib/math/interval.h"
#include "lib/math/vec.h"

namespace pileus {

class Affine;
class LocalForm;
class Quadric;
enum class Join : int;
struct Blend;
struct FormProgram;
struct Perturbation;

/// A solid given by a function of space: inside is f(p) >= 0. It is made of quadrics (lib/freeform/shapes.h)
/// by perturbation, by joining, by morphing and by placing; each makes a new form, and copies share what they
/// are made of. An ellipsoid is 1 at its centre and 0 on its surface; docs/freeform.md has the formulas.
/// ref:     vyatkin2013; METHODS 4
/// threads: const calls are safe from many threads
class FreeForm {
 public:
  FreeForm();                     ///< the unit ball
  FreeForm(const Quadric& base);  // NOLINT(google-explicit-constructor): a quadric is a free form
  explicit FreeForm(FormProgram form);

  /// f at a point of world space [1].
  double value(const Vec3d& p_world) const;

  /// Gradient of f [1/m]; it points inwards. Where f has none, on the edge of a sharp join, that of one side.
  Vec3d gradient(const Vec3d& p_world) const;

  /// Bounds of f over a box of world space, rounding included: above 0 the box is inside, below 0 outside.
  Interval range(const Box3d& box_world) const;

  double upper_bound(const Box3d& box_world) const { return range(box_world).hi; }
  double lower_bound(const Box3d& box_world) const { return range(box_world).lo; }

  /// World-space box that holds the solid [m], to rounding; infinite where the solid has no end, empty
  /// (Box3d::isEmpty) where it is.
  const Box3d& bounds() const;

  /// The form in a box (lib/freeform/local_form.h): bounds for f in single precision, and the fast way to f
  /// at many points of the box.
  LocalForm within(const Box3d& box_world) const;

  /// The form with its morphs as they are at a time; forms are made as at time 0.
  FreeForm at(double time) const;
  bool changes_over_time() const;

  /// What the form is made of (lib/freeform/form_program.h).
  const FormProgram& program() const;

 private:
  struct Shared;
  std::shared_ptr<Shared> m_shared;
};

/// Bounds of f over a box and over all times from time0 to time1: for motion blur.
Interval range_over_time(const FreeForm& form, const Box3d& box_world, double time0, double time1);

/// f + sum factor_i max(0, Q_i)³ (lib/freeform/form_program.h)
FreeForm perturbed(const FreeForm& form, const std::vector<Perturbation>& perturbations);

/// Union, intersection or difference a without b (lib/freeform/join.h).
FreeForm joined(Join join, const FreeForm& a, const FreeForm& b, const Blend& blend);
FreeForm joined(Join join, const FreeForm& a, const FreeForm& b);

/// (1 - beta) from + beta to. beta follows [time, beta] pairs, times ascending, 0 <= beta <= 1: linear in
/// between, constant before and after.
FreeForm morphed(const FreeForm& from, const FreeForm& to, const std::vector<Vec2d>& beta_keys);
FreeForm morphed(const FreeForm& from, const FreeForm& to, double beta);

/// The form after space has been moved by a map that is not singular.
FreeForm placed(const FreeForm& form, const Affine& world_from_form);

}  // namespace pileus
