#pragma once

namespace pileus {

// Effects can be compiled out (CMake option PILEUS_WITHOUT) for one purpose: bench/effects counts the
// instructions of a scene that does without an effect, with and without the effect's code, and finds that
// what is off costs nothing.

#ifdef PILEUS_WITHOUT_SHADOWS
inline constexpr bool kHasShadows = false;
#else
inline constexpr bool kHasShadows = true;
#endif

#ifdef PILEUS_WITHOUT_PHASE
inline constexpr bool kHasPhase = false;
#else
inline constexpr bool kHasPhase = true;
#endif

#ifdef PILEUS_WITHOUT_EMISSION
inline constexpr bool kHasEmission = false;
#else
inline constexpr bool kHasEmission = true;
#endif

#ifdef PILEUS_WITHOUT_SEVERAL_MEDIA
inline constexpr bool kHasSeveralMedia = false;
#else
inline constexpr bool kHasSeveralMedia = true;
#endif

#ifdef PILEUS_WITHOUT_LEVEL_OF_DETAIL
inline constexpr bool kHasLevelOfDetail = false;
#else
inline constexpr bool kHasLevelOfDetail = true;
#endif

#ifdef PILEUS_WITHOUT_AOVS
inline constexpr bool kHasAovs = false;
#else
inline constexpr bool kHasAovs = true;
#endif

}  // namespace pileus
