#pragma once

/// Power series behind the exponential and logarithm of rotations, generic in the scalar so that SIMD lanes share them.
/// Each is accurate to 2 units in the last place on its range, 0 <= x <= kSeriesLimit.
namespace layfigure::math {

/// x = (sine or half of the angle)^2: the half-angle series cover rotations up to about 1 rad.
inline constexpr double kSeriesLimit = 0.25;

/// cos(sqrt(x)) = sum (-x)^k / (2k)!. First omitted term: 0.25^8 / 16! < 1e-18.
template <class T>
inline T cos_sqrt(T x) {
  const T y = x * x;
  const T even = 1.0 + y * (1.0 / 24 + y * (1.0 / 40320 + y * (1.0 / 479001600)));
  const T odd = 1.0 / 2 + y * (1.0 / 720 + y * (1.0 / 3628800 + y * (1.0 / 87178291200.0)));
  return even - x * odd;
}

/// sin(sqrt(x)) / sqrt(x) = sum (-x)^k / (2k + 1)!. First omitted term: 0.25^8 / 17! < 1e-19.
template <class T>
inline T sinc_sqrt(T x) {
  const T y = x * x;
  const T even = 1.0 + y * (1.0 / 120 + y * (1.0 / 362880 + y * (1.0 / 6227020800.0)));
  const T odd = 1.0 / 6 + y * (1.0 / 5040 + y * (1.0 / 39916800 + y * (1.0 / 1307674368000.0)));
  return even - x * odd;
}

/// asin(sqrt(x)) / sqrt(x): 1 + x p(x), p interpolating at 13 Chebyshev nodes; error of the polynomial 4e-18.
template <class T>
inline T asinc_sqrt(T x) {
  const T y = x * x;
  const T even = 0.16666666666666668 +
                 y * (0.04464285714635543 +
                      y * (0.022372172942149888 +
                           y * (0.013971212973552933 +
                                y * (0.010322814350185779 + y * (0.017400879442694022 + y * 0.028757851367421565)))));
  const T odd = 0.074999999999984329 +
                y * (0.030381944138531247 +
                     y * (0.017352392720869973 +
                          y * (0.011479177415184906 + y * (0.0054575067186403583 + y * -0.014851887071247203))));
  return 1.0 + x * (even + x * odd);
}

}  // namespace layfigure::math
