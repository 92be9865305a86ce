// Reading and writing pictures of 6.3 megapixels beside the libraries themselves, on one thread. Times are the least
// CPU time of ten runs, so that a busy machine does not count.

#include <lumihull/base/files.h>
#include <lumihull/base/image.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <ctime>
#include <filesystem>
#include <functional>
#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>
#include <random>
#include <vector>

// Wants <cstdio> before it.
#include <jpeglib.h>

namespace {

using namespace lumihull;

constexpr int kWidth = 3072, kHeight = 2048;

double cpu_seconds(const std::function<void()>& body) {
  double least = INFINITY;
  for (int i = 0; i < 10; ++i) {
    timespec a{}, b{};
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &a);
    body();
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &b);
    least = std::min(least, double(b.tv_sec - a.tv_sec) + 1e-9 * double(b.tv_nsec - a.tv_nsec));
  }
  return least;
}

/// Shading, texture and noise, so that the JPEG has a photograph's size.
Image photograph() {
  Image image(kWidth, kHeight, 3);
  std::mt19937 random(1);
  std::normal_distribution<float> noise(0, 3);
  for (int y = 0; y < kHeight; ++y)
    for (int x = 0; x < kWidth; ++x)
      for (int c = 0; c < 3; ++c) {
        const double v =
            120 + 60 * std::sin(x * 0.01 + c) * std::cos(y * 0.013) + 25 * std::sin(x * 0.4) * std::sin(y * 0.3);
        image.row<std::uint8_t>(y)[3 * x + c] = std::uint8_t(std::clamp(v + noise(random), 0.0, 255.0));
      }
  return image;
}

/// A blob with soft edges.
Image mask() {
  Image image(kWidth, kHeight, 1);
  for (int y = 0; y < kHeight; ++y)
    for (int x = 0; x < kWidth; ++x) {
      const double dx = x - kWidth / 2.0, dy = y - kHeight / 2.0, a = std::atan2(dy, dx);
      const double edge = 700 + 120 * std::sin(5 * a) + 15 * std::sin(90 * a) - std::hypot(dx, dy);
      image.row<std::uint8_t>(y)[x] = std::uint8_t(std::clamp(127 + 127 * edge, 0.0, 255.0));
    }
  return image;
}

/// What libjpeg-turbo's documentation does, without any check: the floor.
void decode_plainly(const std::string& jpeg, unsigned char* pixels) {
  jpeg_decompress_struct info;
  jpeg_error_mgr errors;
  info.err = jpeg_std_error(&errors);
  jpeg_create_decompress(&info);
  jpeg_mem_src(&info, reinterpret_cast<const unsigned char*>(jpeg.data()), jpeg.size());
  jpeg_read_header(&info, TRUE);
  jpeg_start_decompress(&info);
  while (info.output_scanline < info.output_height) {
    JSAMPROW row = pixels + std::size_t(info.output_scanline) * kWidth * 3;
    jpeg_read_scanlines(&info, &row, 1);
  }
  jpeg_finish_decompress(&info);
  jpeg_destroy_decompress(&info);
}

void print(const char* what, double seconds, double peer) {
  std::printf("%-46s %8.2f ms   %5.2f x\n", what, 1e3 * seconds, seconds / peer);
}

}  // namespace

int main() {
  cv::setNumThreads(1);
  const auto folder = std::filesystem::temp_directory_path();
  const std::string jpeg = encode_jpeg(photograph(), 90);
  const auto file = folder / "lumihull-bench.jpg";
  write_file(file, jpeg);
  std::printf("JPEG of %d x %d, 4:4:4, %.1f MB\n", kWidth, kHeight, double(jpeg.size()) / 1e6);

  std::vector<unsigned char> pixels(std::size_t(kWidth) * kHeight * 3);
  const auto turbo_decode = [&] { decode_plainly(jpeg, pixels.data()); };
  const double peer = cpu_seconds(turbo_decode);
  print("libjpeg-turbo into memory that is there", peer, peer);
  print("libjpeg-turbo into new memory", cpu_seconds([&] {
          std::vector<unsigned char>().swap(pixels);
          pixels.resize(std::size_t(kWidth) * kHeight * 3);
          turbo_decode();
        }),
        peer);
  Image ours;
  print("lumihull::decode_image (new memory)",
        cpu_seconds([&] { ours = decode_image(std::as_bytes(std::span(jpeg)), "a"); }), peer);
  print("lumihull::read_image from a file", cpu_seconds([&] { ours = read_image(file); }), peer);
  const std::vector<char> bytes(jpeg.begin(), jpeg.end());
  cv::Mat mat;
  print("cv::imdecode", cpu_seconds([&] { mat = cv::imdecode(bytes, cv::IMREAD_COLOR); }), peer);
  turbo_decode();
  std::printf("pixels that differ from libjpeg-turbo's: %s\n",
              std::memcmp(ours.data(), pixels.data(), ours.bytes()) == 0 ? "none" : "SOME");
  std::printf("%-46s %8.2f us\n", "lumihull::read_image_info", 1e6 / 1000 * cpu_seconds([&] {
                                                                 for (int i = 0; i < 1000; ++i) read_image_info(file);
                                                               }));

  const Image silhouette = mask();
  std::string png;
  const double own = cpu_seconds([&] { png = encode_mask(silhouette); });
  std::vector<unsigned char> encoded;
  const cv::Mat gray(silhouette.height(), silhouette.width(), CV_8UC1, const_cast<std::byte*>(silhouette.data()));
  const auto opencv = [&](int strategy) {
    const double seconds = cpu_seconds([&] {
      cv::imencode(".png", gray, encoded, {cv::IMWRITE_PNG_COMPRESSION, 1, cv::IMWRITE_PNG_STRATEGY, strategy});
    });
    std::printf("mask, cv::imencode level 1, strategy %d: %.2f ms, %zu bytes, %.1f x ours\n", strategy, 1e3 * seconds,
                encoded.size(), seconds / own);
  };
  std::printf("mask, lumihull::encode_mask: %.2f ms, %zu bytes\n", 1e3 * own, png.size());
  opencv(cv::IMWRITE_PNG_STRATEGY_DEFAULT);
  opencv(cv::IMWRITE_PNG_STRATEGY_RLE);
  std::string plain;
  const double usual = cpu_seconds([&] { plain = encode_png(silhouette); });
  std::printf("mask, lumihull::encode_png: %.2f ms, %zu bytes, %.1f x ours\n", 1e3 * usual, plain.size(), usual / own);
  const double read = cpu_seconds([&] { ours = decode_image(std::as_bytes(std::span(png)), "m"); });
  std::printf("mask read, lumihull::decode_image: %.2f ms; %s\n", 1e3 * read,
              std::memcmp(ours.data(), silhouette.data(), silhouette.bytes()) == 0 ? "the same" : "NOT THE SAME");
  const std::vector<char> ours_png(png.begin(), png.end());
  const double peer_read = cpu_seconds([&] { mat = cv::imdecode(ours_png, cv::IMREAD_GRAYSCALE); });
  std::printf("mask read, cv::imdecode: %.2f ms, %.1f x ours\n", 1e3 * peer_read, peer_read / read);
  std::filesystem::remove(file);
}
