// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "bench/paper/published.h"

#include "deform/errors.h"

namespace tetwarp::bench {

namespace {

constexpr PublishedGpu kDesktop = PublishedGpu::rtx_2080, kNotebook = PublishedGpu::gtx_1650_mobile;
using About = PublishedClaim::About;
constexpr Method kA4x4 = Method::inverse4x4_double, kB3x3 = Method::inverse3x3_double,
                 kAguilera = Method::inverse3x3_float, kProposed = Method::paper;

constexpr PublishedData kData[] = {{"abdomen", 300, 150}, {"lung", 316, 158}, {"colon", 141, 70.5}, {"leg", 600, 300}};

constexpr PublishedTime kTimes[] = {
    {2, 'a', kA4x4, "wave", "abdomen", kDesktop, 348.14},
    {2, 'b', kB3x3, "wave", "abdomen", kDesktop, 150.55},
    {2, 'c', kAguilera, "wave", "abdomen", kDesktop, 22.55},
    {2, 'a', kA4x4, "twist", "abdomen", kDesktop, 376.11},
    {2, 'b', kB3x3, "twist", "abdomen", kDesktop, 166.57},
    {2, 'c', kAguilera, "twist", "abdomen", kDesktop, 26.56},
    {2, 'a', kA4x4, "bubble", "abdomen", kDesktop, 385.36},
    {2, 'b', kB3x3, "bubble", "abdomen", kDesktop, 168.49},
    {2, 'c', kAguilera, "bubble", "abdomen", kDesktop, 17.44},
    {2, 'a', kA4x4, "wave", "abdomen", kNotebook, 892.85},
    {2, 'b', kB3x3, "wave", "abdomen", kNotebook, 360.26},
    {2, 'c', kAguilera, "wave", "abdomen", kNotebook, 60.40},
    {2, 'a', kA4x4, "twist", "abdomen", kNotebook, 989.42},
    {2, 'b', kB3x3, "twist", "abdomen", kNotebook, 415.30},
    {2, 'c', kAguilera, "twist", "abdomen", kNotebook, 98.55},
    {2, 'a', kA4x4, "bubble", "abdomen", kNotebook, 940.06},
    {2, 'b', kB3x3, "bubble", "abdomen", kNotebook, 402.53},
    {2, 'c', kAguilera, "bubble", "abdomen", kNotebook, 58.39},
    {3, 'a', kAguilera, "wave", "abdomen", kDesktop, 22.55},
    {3, 'b', kProposed, "wave", "abdomen", kDesktop, 19.75},
    {3, 'a', kAguilera, "twist", "abdomen", kDesktop, 26.56},
    {3, 'b', kProposed, "twist", "abdomen", kDesktop, 23.82},
    {3, 'a', kAguilera, "bubble", "abdomen", kDesktop, 17.44},
    {3, 'b', kProposed, "bubble", "abdomen", kDesktop, 14.08},
    {3, 'a', kAguilera, "wave", "abdomen", kNotebook, 60.40},
    {3, 'b', kProposed, "wave", "abdomen", kNotebook, 51.27},
    {3, 'a', kAguilera, "twist", "abdomen", kNotebook, 98.55},
    {3, 'b', kProposed, "twist", "abdomen", kNotebook, 90.78},
    {3, 'a', kAguilera, "bubble", "abdomen", kNotebook, 58.39},
    {3, 'b', kProposed, "bubble", "abdomen", kNotebook, 47.18},
    {4, 'a', kAguilera, "wave", "abdomen", kNotebook, 60.40},
    {4, 'b', kProposed, "wave", "abdomen", kNotebook, 51.27},
    {4, 'a', kAguilera, "wave", "lung", kNotebook, 63.53},
    {4, 'b', kProposed, "wave", "lung", kNotebook, 54.87},
    {4, 'a', kAguilera, "wave", "colon", kNotebook, 29.37},
    {4, 'b', kProposed, "wave", "colon", kNotebook, 24.46},
    {4, 'a', kAguilera, "wave", "leg", kNotebook, 149.37},
    {4, 'b', kProposed, "wave", "leg", kNotebook, 127.19},
};

constexpr PublishedSpeedUp kSpeedUps[] = {
    {2, kA4x4, kAguilera, "wave", kDesktop, 15.43},      {2, kA4x4, kAguilera, "twist", kDesktop, 14.16},
    {2, kA4x4, kAguilera, "bubble", kDesktop, 22.09},    {2, kA4x4, kAguilera, "wave", kNotebook, 14.78},
    {2, kA4x4, kAguilera, "twist", kNotebook, 10.03},    {2, kA4x4, kAguilera, "bubble", kNotebook, 16.09},
    {3, kAguilera, kProposed, "wave", kDesktop, 1.14},   {3, kAguilera, kProposed, "twist", kDesktop, 1.11},
    {3, kAguilera, kProposed, "bubble", kDesktop, 1.23}, {3, kAguilera, kProposed, "wave", kNotebook, 1.17},
    {3, kAguilera, kProposed, "twist", kNotebook, 1.09}, {3, kAguilera, kProposed, "bubble", kNotebook, 1.23},
};

constexpr PublishedClaim kClaims[] = {
    {About::frames_a_second, "frames a second, GeForce RTX 2080", "40 and more"},
    {About::frames_a_second, "frames a second, GeForce GTX 1650 Mobile", "10"},
    {About::picture, "the picture, in none of the times; RTX 2080, GTX 1650 Mobile", "below 1 ms, about 14 ms"},
    {About::tetrahedra, "tetrahedra at 512 x 512 x 600", "786 M"},
    {About::others, "the same, Aguilera; Gascon", "65 M; fewer than 5000"},
    {About::bytes_a_thread, "bytes a thread, both places of eight vertices", "192"},
    {About::others, "the same, Aguilera", "112"},
    {About::differences, "differences between the pictures of Table 2 (a), (b), (c)", "none"},
};

constexpr PublishedAppendix kAppendix{
    .corners = {{255.9, 256.7, 133.1}, {256.7, 255.9, 133.4}, {256.7, 256.7, 132.3}, {255.9, 255.9, 132.3}},
    .determinant_in_double = 1.216,
    .determinant_in_float = 2.010187,
    .inverse_in_double = {-0.723684, 0.526316, 0.723684, -0.526316},
    .inverse_in_float = {-0.437228, 0.318691, 0.437228, -0.318691}};

}  // namespace

std::span<const PublishedData> published_data() { return kData; }
std::span<const PublishedTime> published_times() { return kTimes; }
std::span<const PublishedSpeedUp> published_speed_ups() { return kSpeedUps; }
std::span<const PublishedClaim> published_claims() { return kClaims; }
const PublishedAppendix& published_appendix() { return kAppendix; }

const PublishedData& published_data(const std::string& name) {
  for (const PublishedData& data : kData) {
    if (name == data.name) return data;
  }
  throw InputError("Table 1 has no data set \"" + name + "\"; expected abdomen, lung, colon or leg");
}

std::string name_of(PublishedGpu gpu) {
  return gpu == PublishedGpu::rtx_2080 ? "GeForce RTX 2080" : "GeForce GTX 1650 Mobile";
}

}  // namespace tetwarp::bench
