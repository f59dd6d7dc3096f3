#pragma once

#include "lib/image/plane.h"

namespace pileus {

/// Structural similarity of two planes of display values in [0, 1] of equal size: 1 where they are alike,
/// less where they differ, seldom below 0; the mean over all pixels. Windows are Gaussian, 11 x 11 with
/// sigma 1.5, and K1 = 0.01, K2 = 0.03 as published. Where a window reaches beyond the border, the weights
/// inside are scaled to sum 1; pictures are not scaled down first. ref: wang2004 (Image quality assessment:
/// from error visibility to structural similarity), eq. 13
double ssim(const Plane& test, const Plane& reference);

}  // namespace pileus
