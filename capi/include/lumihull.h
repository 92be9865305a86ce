/**
 * Lumihull's C interface: photographs of an object in; silhouettes, a mesh and new views out.
 *
 * Rules that hold for every function here:
 *
 * - A call that can fail returns lh_status: LH_OK (0), or a negative LH_E… . On failure its outputs are untouched, and
 *   the context holds a one-line message and the subject (a file, a photograph) that it is about. No call throws,
 *   and no argument of documented type crashes it, except a pointer to memory that is not the caller's.
 * - One context a thread at a time. Handles (lh_capture, lh_mesh, …) belong to no context. lh_image, lh_color_key,
 *   lh_mesh, lh_ray_scene and lh_target_set never change once they are made: any number of threads may read one. The others:
 *   one thread at a time.
 * - Arrays and strings that the caller passes are borrowed for the call. Strings are UTF-8 and end with NUL.
 * - Results of unknown length are read in two calls: first with a NULL buffer, which stores the size in *needed, then
 *   with a buffer of at least that size. Texts count their closing NUL. A buffer that is too small is LH_EINVAL.
 * - Structures start with `struct_size`, to be set to sizeof the structure; they only ever grow at the end. A smaller
 *   size than today's is an older caller's and is accepted; a larger one is accepted where what is unknown is zero. In
 *   option structures zero means the default for every field, so that
 *   `lh_carve_options o = {0}; o.struct_size = sizeof o;` is the defaults; and a NULL pointer is the defaults, too.
 * - A rigid transform is 3 x 4, row-major, [R t]: cam_from_world maps world points to the camera's frame: x right, y
 *   down, z forward. R is to be a rotation to within 1e-6. Units are the capture's: metres, or unknown.
 * - Pixels: the centre of the first one is (0.5, 0.5). Pictures are row-major, channels interleaved, sRGB.
 * - `int32_t` flags: 0 is no, anything else is yes.
 *
 * A complete program: examples/c/turntable.c.
 */
#ifndef LUMIHULL_H
#define LUMIHULL_H

#include <stddef.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

#if defined(__GNUC__)
#define LH_API __attribute__((visibility("default")))
#else
#define LH_API
#endif

/* ---- status ------------------------------------------------------------------------------------------------------ */

typedef int32_t lh_status;

#define LH_OK ((lh_status)0)
#define LH_EINVAL ((lh_status)-1)       /**< an argument is outside its documented range */
#define LH_EINPUT ((lh_status)-2)       /**< a file, picture or number from outside is not what it should be */
#define LH_ENOTFOUND ((lh_status)-3)    /**< a file, folder or entry does not exist */
#define LH_EIO ((lh_status)-4)          /**< the system refused to read or write: disk full, permissions */
#define LH_EUNSUPPORTED ((lh_status)-5) /**< valid, but this build can't do it */
#define LH_EDEGENERATE ((lh_status)-6)  /**< valid, but the geometry has no (unique) answer */
#define LH_ENOMEM ((lh_status)-7)       /**< out of memory */
#define LH_ECANCELLED ((lh_status)-8)   /**< lh_context_cancel was called */
#define LH_EINTERNAL ((lh_status)-9)    /**< a defect of Lumihull */

/** A word or two for a status, e.g. "not found"; never NULL, static. */
LH_API const char *lh_status_text(lh_status status);

/** The library's version, "major.minor.patch"; static. */
LH_API const char *lh_version(void);

/* ---- context ----------------------------------------------------------------------------------------------------- */

/** Error state, progress, cancel and number of threads. */
typedef struct lh_context lh_context;

/** How far a long call is. */
typedef struct lh_progress {
  size_t struct_size;
  const char *stage; /**< what is being done, e.g. "keying"; valid during the callback */
  uint64_t done;     /**< steps, 0 … total */
  uint64_t total;
  double elapsed_s; /**< since this stage began */
  double eta_s;     /**< to go at the speed so far; negative: not known yet */
} lh_progress;

/** Called on the thread that made the long call, at most ten times a second and at the end of a stage. It must not use
 *  the context except for lh_context_cancel; other calls with it return LH_EINVAL. */
typedef void (*lh_progress_fn)(void *user, const lh_progress *progress);

/** A new context; NULL where there is no memory. */
LH_API lh_context *lh_context_create(void);
/** NULL is allowed. No call may be running in it. */
LH_API void lh_context_destroy(lh_context *ctx);

/** fn: NULL takes the callback away. user is handed to it. */
LH_API lh_status lh_context_set_progress(lh_context *ctx, lh_progress_fn fn, void *user);
/** threads: how many a call may use, at most 1024; 0: one for each core, as at first. No result depends on it. */
LH_API lh_status lh_context_set_threads(lh_context *ctx, uint32_t threads);

/** Stops the running call, which returns LH_ECANCELLED soon, and every later long call before it begins, until
 *  lh_context_clear_cancel. From any thread, and from a signal handler. NULL is allowed. */
LH_API void lh_context_cancel(lh_context *ctx);
/** Lets long calls run again. NULL is allowed. */
LH_API void lh_context_clear_cancel(lh_context *ctx);
/** 1 after lh_context_cancel, else 0. From any thread. */
LH_API int32_t lh_context_cancelled(const lh_context *ctx);

/** Status of the last call with this context; LH_EINVAL for NULL. */
LH_API lh_status lh_context_status(const lh_context *ctx);
/** One line about the last call's failure: what was expected or what to do; "" after success. Valid until the next call
 *  with the context; never NULL. */
LH_API const char *lh_context_message(const lh_context *ctx);
/** What the message is about: a file, a photograph, an argument; may be "". Valid until the next call; never NULL. */
LH_API const char *lh_context_subject(const lh_context *ctx);

/* ---- camera ------------------------------------------------------------------------------------------------------ */

/**
 * A camera with Heikkilä's lens model (Heikkilä 2000): with (x, y) the distorted normalised point and r² = x² + y²,
 *
 *     corrected = (x, y) + (x (k1 r² + k2 r⁴ + k3 r⁶) + 2 p1 x y + p2 (r² + 2 x²),
 *                           y (k1 r² + k2 r⁴ + k3 r⁶) + p1 (r² + 2 y²) + 2 p2 x y)
 *     pixel     = (s f x + skew y + u0, f y + v0)
 */
typedef struct lh_camera {
  size_t struct_size;
  int32_t width, height; /**< px, > 0 */
  double f;              /**< focal length along v, px, > 0 */
  double s;              /**< aspect, > 0: the focal length along u is s f */
  double skew;           /**< px */
  double u0, v0;         /**< principal point, px */
  double k1, k2, k3, p1, p2;
} lh_camera;

/**
 * Pixels of points in the camera's frame.
 *
 * @param points    n x 3
 * @param n         may be 0
 * @param pixels    n x 2, px; NaN where a point lies behind the camera (z <= 0) or beyond the lens model's domain. A
 *                  pixel may lie outside the picture
 * @param jacobians NULL, or n x 2 x 3: d pixel / d point, NaN likewise
 * @return LH_EINVAL: camera out of range
 */
LH_API lh_status lh_camera_project(lh_context *ctx, const lh_camera *camera, const double *points, size_t n,
                                   double *pixels, double *jacobians);

/**
 * Directions that pixels see, in the camera's frame.
 *
 * @param pixels n x 2, px
 * @param rays   n x 3: (x, y, 1), not normalised; NaN for a pixel beyond the lens model's domain
 */
LH_API lh_status lh_camera_unproject(lh_context *ctx, const lh_camera *camera, const double *pixels, size_t n,
                                     double *rays);

/** The pose of a camera at eye that looks at target. up: any direction that is not parallel to the line of sight.
 *  @return LH_EINVAL: not finite, or up parallel to the line of sight */
LH_API lh_status lh_pose_look_at(lh_context *ctx, const double eye[3], const double target[3], const double up[3],
                                 double cam_from_world[12]);

/* ---- pictures ---------------------------------------------------------------------------------------------------- */

/** A picture in memory: height x width x channels, rows without gaps. */
typedef struct lh_image lh_image;

#define LH_PIXEL_U8 1  /**< uint8_t, 0 … 255 */
#define LH_PIXEL_U16 2 /**< uint16_t, 0 … 65535 */
#define LH_PIXEL_F32 4 /**< float, 0 … 1. The constants are bytes a channel */

typedef struct lh_image_options {
  size_t struct_size;
  int32_t apply_orientation; /**< yes: turn it upright by its EXIF orientation. Off for what cameras refer to */
  int32_t channels;          /**< 0: as stored; 1, 3 or 4: convert */
} lh_image_options;

/** Reads a photograph: JPEG, PNG; TIFF, camera RAW and the rest where that module was built.
 *  @return LH_ENOTFOUND, LH_EIO, LH_EINPUT: damaged or truncated, LH_EUNSUPPORTED: no module for the format */
LH_API lh_status lh_image_read(lh_context *ctx, const char *file, const lh_image_options *options, lh_image **out);
/** The same from the bytes of a JPEG or PNG in memory; name is used in messages. */
LH_API lh_status lh_image_decode(lh_context *ctx, const void *bytes, size_t size, const char *name,
                                 const lh_image_options *options, lh_image **out);
/** A copy of an array. channels: 1, 3 or 4; pixel_type: LH_PIXEL_…; row_bytes: from one row to the next, 0: no gaps. */
LH_API lh_status lh_image_from_array(lh_context *ctx, const void *data, int32_t width, int32_t height, int32_t channels,
                                     int32_t pixel_type, size_t row_bytes, lh_image **out);
LH_API void lh_image_destroy(lh_image *image);

/** 0 for NULL. */
LH_API int32_t lh_image_width(const lh_image *image);
LH_API int32_t lh_image_height(const lh_image *image);
LH_API int32_t lh_image_channels(const lh_image *image);
LH_API int32_t lh_image_pixel_type(const lh_image *image);
/** Pixels, valid while the image lives: height x width x channels values of the pixel type. NULL for NULL. */
LH_API const void *lh_image_data(const lh_image *image);

/** 8- or 16-bit pictures of 1, 3 or 4 channels; written aside and renamed. @return LH_EIO; LH_EINVAL: float pixels */
LH_API lh_status lh_image_write_png(lh_context *ctx, const lh_image *image, const char *file);
/** 8-bit pictures of 1 or 3 channels; quality 1 … 100. */
LH_API lh_status lh_image_write_jpeg(lh_context *ctx, const lh_image *image, const char *file, int32_t quality);

/* ---- colour key -------------------------------------------------------------------------------------------------- */

/** Decides by colour whether a pixel is object or enclosure: exact k nearest neighbours in RGB. */
typedef struct lh_color_key lh_color_key;

typedef struct lh_color_key_options {
  size_t struct_size;
  int32_t k;               /**< neighbours asked, 1 … 255; 0: 7 */
  uint32_t seed;           /**< of the uniform foreground samples; 0: 1 */
  double foreground_share; /**< foreground samples as a share of the background's; 0: 0.2 */
} lh_color_key_options;

/**
 * Trains a key.
 *
 * @param background   n x 3, 8-bit sRGB: colours of the enclosure
 * @param n            >= k
 * @param foreground   m x 3: colours of what is looked for; NULL: uniform in the RGB cube
 * @param m            0 where foreground is NULL
 * @return LH_EINVAL: options, too few or more than ten million samples; LH_ECANCELLED
 */
LH_API lh_status lh_color_key_train(lh_context *ctx, const uint8_t *background, size_t n, const uint8_t *foreground,
                                    size_t m, const lh_color_key_options *options, lh_color_key **out);
/** @return LH_ENOTFOUND, LH_EIO, LH_EINPUT */
LH_API lh_status lh_color_key_load(lh_context *ctx, const char *file, lh_color_key **out);
LH_API lh_status lh_color_key_save(lh_context *ctx, const lh_color_key *key, const char *file);
LH_API void lh_color_key_destroy(lh_color_key *key);

/** Decides colours: rgb n x 3, 8-bit; mask n: 255 = object, 0 = background. */
LH_API lh_status lh_color_key_decide(lh_context *ctx, const lh_color_key *key, const uint8_t *rgb, size_t n,
                                     uint8_t *mask);
/** P(object | colour), the share of foreground among the k nearest samples: rgb n x 3, probability n. */
LH_API lh_status lh_color_key_probability(lh_context *ctx, const lh_color_key *key, const uint8_t *rgb, size_t n,
                                          double *probability);

#define LH_EDGES_SOFT 0  /**< edge pixels carry their share of object; 128 and more is the pure decision */
#define LH_EDGES_HARD 1  /**< 0 and 255 only */
#define LH_EDGES_MATTE 2 /**< as soft, and the share may move a mixed pixel across 128 */

typedef struct lh_silhouette_options {
  size_t struct_size;
  int32_t edges;              /**< LH_EDGES_… */
  int32_t smallest_object_px; /**< objects of fewer pixels become background; 0: kept */
  int32_t largest_hole_px;    /**< holes of at most so many pixels are filled; 0: kept */
} lh_silhouette_options;

/** The silhouette of a photograph: 8 bits, 1 channel, 255 = object, of the photograph's size.
 *  photo: 3 channels, or 4, whose alpha is ignored. */
LH_API lh_status lh_color_key_silhouette(lh_context *ctx, const lh_color_key *key, const lh_image *photo,
                                         const lh_silhouette_options *options, lh_image **out);

/* ---- mesh -------------------------------------------------------------------------------------------------------- */

/** Triangles over shared vertices, counter-clockwise seen from outside. */
typedef struct lh_mesh lh_mesh;

/** vertices: n x 3; triangles: m x 3 indices of vertices. Both are copied.
 *  @return LH_EINPUT: an index out of range or a coordinate that is not finite */
LH_API lh_status lh_mesh_from_arrays(lh_context *ctx, const float *vertices, size_t n, const uint32_t *triangles,
                                     size_t m, lh_mesh **out);
/** PLY or OBJ, by the file's name. @return LH_ENOTFOUND, LH_EIO, LH_EINPUT */
LH_API lh_status lh_mesh_read(lh_context *ctx, const char *file, lh_mesh **out);
/** PLY (binary) or OBJ, by the file's name; written aside and renamed. @return LH_EIO, LH_EINVAL: another ending */
LH_API lh_status lh_mesh_write(lh_context *ctx, const lh_mesh *mesh, const char *file);
LH_API void lh_mesh_destroy(lh_mesh *mesh);

/** 0 for NULL. */
LH_API size_t lh_mesh_vertex_count(const lh_mesh *mesh);
LH_API size_t lh_mesh_triangle_count(const lh_mesh *mesh);
/** Copies the vertices: out n x 3. n: lh_mesh_vertex_count or more. */
LH_API lh_status lh_mesh_vertices(lh_context *ctx, const lh_mesh *mesh, float *out, size_t n);
/** Copies the triangles: out n x 3 indices. n: lh_mesh_triangle_count or more. */
LH_API lh_status lh_mesh_triangles(lh_context *ctx, const lh_mesh *mesh, uint32_t *out, size_t n);
/** Unit normal of each vertex, weighted by area; (0, 0, 0) where undefined: out n x 3, n: vertices or more. */
LH_API lh_status lh_mesh_normals(lh_context *ctx, const lh_mesh *mesh, float *out, size_t n);
/** Volume that a closed mesh encloses, in cubic units; positive where its triangles are oriented outwards. */
LH_API lh_status lh_mesh_volume(lh_context *ctx, const lh_mesh *mesh, double *out);

/** What a mesh is, as a surface. */
typedef struct lh_mesh_report {
  size_t struct_size;
  int32_t closed;   /**< every edge has two triangles */
  int32_t manifold; /**< closed, and the triangles around each vertex are one fan */
  int32_t oriented; /**< every edge is passed once in each direction */
  int32_t self_intersections_known;
  uint64_t self_intersections;   /**< pairs of triangles that pass through each other */
  uint64_t degenerate_triangles; /**< without area */
  uint64_t unused_vertices;
  uint64_t parts; /**< connected by shared vertices */
  int64_t euler;  /**< vertices - edges + triangles: 2 for each part that is like a sphere */
} lh_mesh_report;

/** Examines a mesh. self_intersections: no leaves that count out; it also stays unknown where the mesh is not manifold
 * and where the library was built without CGAL. out: its struct_size says how much of it is filled. */
LH_API lh_status lh_mesh_check(lh_context *ctx, const lh_mesh *mesh, int32_t self_intersections, lh_mesh_report *out);

/**
 * A mesh of fewer triangles; closed and manifold where the given one is.
 *
 * @param max_triangles at most so many are aimed at; 0: as few as max_error allows
 * @param max_error     how far the surface may move, by the simplifier's estimate; 0: no bound
 * @param moved         NULL, or how far it did move: the largest distance between the two surfaces
 * @return LH_EINVAL: neither bound is set
 */
LH_API lh_status lh_mesh_simplify(lh_context *ctx, const lh_mesh *mesh, size_t max_triangles, double max_error,
                                  lh_mesh **out, double *moved);

/* ---- visual hull ------------------------------------------------------------------------------------------------- */

typedef struct lh_carve_options {
  size_t struct_size;
  int32_t resolution;       /**< cubic voxels along the longest side of the region, 8 … 2048; 0: 256 */
  int32_t has_region;       /**< no: the region is found from cameras and masks */
  double region[6];         /**< x, y, z of the least corner, then of the greatest */
  int32_t tolerance;        /**< a point is carved only where so many views say so; 0: 1, the visual hull */
  int32_t min_views;        /**< a point that fewer views see is no object; 0: 1 */
  double min_component;     /**< parts below this share of the largest part's volume go; 0: 0.01; negative: all stay */
  const double *cut_planes; /**< n x 4, (normal, offset): what lies at normal · x > offset is cut away */
  size_t cut_plane_count;   /**< n */
  const double *cut_boxes;  /**< n x 6, like region: what lies within is cut away */
  size_t cut_box_count;     /**< n */
} lh_carve_options;

/**
 * The visual hull of silhouettes: what is left of space when everything that a camera sees as background is taken away.
 *
 * @param n              views, 1 … 1,000,000
 * @param cameras        n, each with the same struct_size, which is also the distance from one to the next
 * @param cam_from_world n x 12
 * @param masks          n pointers, each to height x width bytes of its camera: 255 = object, 0 = background; values
 *                       between say how much of a pixel is object, the contour runs at 127.5
 * @param out            a closed mesh
 * @return LH_EDEGENERATE: no bounded region is common to the views, the hull vanishes (the message names the views that
 *         carve everything away), a camera is inside the object; LH_ECANCELLED
 * Source: Laurentini 1994.
 */
LH_API lh_status lh_hull_carve(lh_context *ctx, size_t n, const lh_camera *cameras, const double *cam_from_world,
                               const uint8_t *const *masks, const lh_carve_options *options, lh_mesh **out);

/* ---- rays -------------------------------------------------------------------------------------------------------- */

/** A mesh made ready for ray casting. */
typedef struct lh_ray_scene lh_ray_scene;

#define LH_NO_HIT UINT32_MAX

/** Copies what it needs of the mesh. */
LH_API lh_status lh_ray_scene_create(lh_context *ctx, const lh_mesh *mesh, lh_ray_scene **out);
LH_API void lh_ray_scene_destroy(lh_ray_scene *scene);

/**
 * The first triangle along each ray, both sides counting.
 *
 * @param origins     n x 3
 * @param directions  n x 3; need not be unit length
 * @param triangle    n; LH_NO_HIT where nothing was hit
 * @param distance    NULL, or n: the point is origin + distance direction; infinite where nothing was hit
 * @param barycentric NULL, or n x 2, (b1, b2): the point is (1 - b1 - b2) v0 + b1 v1 + b2 v2; 0 where nothing was hit
 */
LH_API lh_status lh_ray_scene_hit(lh_context *ctx, const lh_ray_scene *scene, const float *origins,
                                  const float *directions, size_t n, uint32_t *triangle, float *distance,
                                  float *barycentric);
/** Whether anything lies on each segment from a to b, the ends excluded by `margin` (a share of its length, 0 … 0.5):
 *  a, b n x 3; occluded n: 1 or 0. */
LH_API lh_status lh_ray_scene_occluded(lh_context *ctx, const lh_ray_scene *scene, const float *a, const float *b,
                                       size_t n, float margin, uint8_t *occluded);

/* ---- capture ----------------------------------------------------------------------------------------------------- */

/** The folder that holds an object's photographs and everything made from them. */
typedef struct lh_capture lh_capture;

/** @return LH_ENOTFOUND: no capture.json; LH_EINPUT: names file, JSON pointer and what was expected */
LH_API lh_status lh_capture_open(lh_context *ctx, const char *folder, lh_capture **out);
/** A new capture in a folder that does not exist yet or is empty. No file is written before lh_capture_save.
 *  @return LH_EINVAL: the folder is in use; LH_EIO */
LH_API lh_status lh_capture_create(lh_context *ctx, const char *folder, lh_capture **out);
/** Writes capture.json and cameras.json, each atomically. */
LH_API lh_status lh_capture_save(lh_context *ctx, const lh_capture *capture);
/** Does not save. */
LH_API void lh_capture_destroy(lh_capture *capture);

/** What is in a capture as one JSON object: photographs, cameras, unit, masks, stages, notes. */
LH_API lh_status lh_capture_describe(lh_context *ctx, const lh_capture *capture, char *buffer, size_t size,
                                     size_t *needed);

/** 0 for NULL. */
LH_API size_t lh_capture_shot_count(const lh_capture *capture);
LH_API size_t lh_capture_camera_count(const lh_capture *capture);

/** Adds a camera; its index is the old lh_capture_camera_count. */
LH_API lh_status lh_capture_add_camera(lh_context *ctx, lh_capture *capture, const lh_camera *camera);
/** camera: its struct_size says how much of it is filled. */
LH_API lh_status lh_capture_get_camera(lh_context *ctx, const lh_capture *capture, size_t index, lh_camera *camera);
LH_API lh_status lh_capture_set_camera(lh_context *ctx, lh_capture *capture, size_t index, const lh_camera *camera);

/** Adds a photograph, not positioned; its index is the old lh_capture_shot_count. file: relative to the capture's
 * folder, or absolute; it is not copied. name: 1 … 200 bytes, no '/' and no control characters.
 * @return LH_EINVAL: name in use or no plain file name, no such camera; LH_ENOTFOUND: no such file */
LH_API lh_status lh_capture_add_shot(lh_context *ctx, lh_capture *capture, const char *name, const char *file,
                                     size_t camera);
/** The shot's unique name. */
LH_API lh_status lh_capture_shot_name(lh_context *ctx, const lh_capture *capture, size_t shot, char *buffer,
                                      size_t size, size_t *needed);
/** The photograph's path. */
LH_API lh_status lh_capture_shot_file(lh_context *ctx, const lh_capture *capture, size_t shot, char *buffer,
                                      size_t size, size_t *needed);
/** The index of the shot's camera. */
LH_API lh_status lh_capture_shot_camera(lh_context *ctx, const lh_capture *capture, size_t shot, size_t *camera);
/** Whether the shot is held out of training, hull and appearance. */
LH_API lh_status lh_capture_shot_held_out(lh_context *ctx, const lh_capture *capture, size_t shot, int32_t *held_out);
/** Every nth shot (the first, the n+1st, …) is held out; 0: none. */
LH_API lh_status lh_capture_set_hold_out(lh_context *ctx, lh_capture *capture, int32_t n);
/** What pictures are composited on when they are judged, 8-bit sRGB; keying sets it where it is not set. */
LH_API lh_status lh_capture_set_background(lh_context *ctx, lh_capture *capture, const uint8_t rgb[3]);
/** @return LH_ENOTFOUND: the shot is not positioned */
LH_API lh_status lh_capture_get_pose(lh_context *ctx, const lh_capture *capture, size_t shot,
                                     double cam_from_world[12]);
/** cam_from_world: NULL takes the pose away. */
LH_API lh_status lh_capture_set_pose(lh_context *ctx, lh_capture *capture, size_t shot,
                                     const double cam_from_world[12]);
/** The photograph, 3 channels. @return LH_EINPUT: its size is not its camera's */
LH_API lh_status lh_capture_read_photo(lh_context *ctx, const lh_capture *capture, size_t shot, lh_image **out);
/** The silhouette, 8 bits, 1 channel, 255 = object. @return LH_ENOTFOUND: there is none */
LH_API lh_status lh_capture_read_mask(lh_context *ctx, const lh_capture *capture, size_t shot, lh_image **out);
/** Stores a silhouette (8 bits, 1 channel, the photograph's size) that keying then leaves alone. */
LH_API lh_status lh_capture_write_mask(lh_context *ctx, lh_capture *capture, size_t shot, const lh_image *mask);
/** The hull's mesh. @return LH_ENOTFOUND: the hull stage has not been run */
LH_API lh_status lh_capture_read_hull(lh_context *ctx, const lh_capture *capture, lh_mesh **out);

/* ---- stages ------------------------------------------------------------------------------------------------------ */

/** Names of the stages in the order in which lh_capture_run does them; NULL for index >= lh_stage_count(). Static. */
LH_API size_t lh_stage_count(void);
LH_API const char *lh_stage_name(size_t index);

/** A stage's options as a JSON array of {"name", "help", "default", "low", "high", "choices", "path"};
    "path": a text that is none of the choices is a file or folder, and is stored as an absolute path. */
LH_API lh_status lh_stage_options(lh_context *ctx, const char *stage, char *buffer, size_t size, size_t *needed);
/** Stores an option of a stage: "150", "0.2", "true", "auto", "-1,2,3.5".
 *  @return LH_EINVAL: no such stage or option, wrong type or out of range: says what was expected */
LH_API lh_status lh_capture_set_option(lh_context *ctx, lh_capture *capture, const char *stage, const char *name,
                                       const char *value);
/** What counts: the stored value, else the default, as text. */
LH_API lh_status lh_capture_get_option(lh_context *ctx, const lh_capture *capture, const char *stage, const char *name,
                                       char *buffer, size_t size, size_t *needed);

/** What a stage did. Everything is valid during the callback. */
typedef struct lh_stage_result {
  size_t struct_size;
  const char *stage;
  int32_t skipped;     /**< inputs and options were those of the last time */
  uint32_t line_count; /**< lines of text: what was done, and warnings that name the photograph */
  const char *const *lines;
  double seconds;
  uint64_t peak_bytes; /**< high-water mark of the process while it ran */
} lh_stage_result;

/** Called on the caller's thread. The same restriction as for lh_progress_fn. */
typedef void (*lh_stage_fn)(void *user, const lh_stage_result *result);

/**
 * Does one stage and saves the capture, unless it was done with the same inputs and options before (or force).
 *
 * @param fn called once with the result; may be NULL
 * @return LH_ENOTFOUND: an earlier stage's result is missing; LH_ECANCELLED: the old result is still in place
 */
LH_API lh_status lh_capture_run_stage(lh_context *ctx, lh_capture *capture, const char *stage, int32_t force,
                                      lh_stage_fn fn, void *user);
/** All the stages that exist and are needed, in order. fn is called when each has ended, those that were left out or
 * skipped included; where one fails, the stages before it keep their results. */
LH_API lh_status lh_capture_run(lh_context *ctx, lh_capture *capture, int32_t force, lh_stage_fn fn, void *user);

/** evaluate/evaluation.json, which the stage "evaluate" leaves: means over the held-out photographs, and each one's
 * values.
 *  @return LH_ENOTFOUND: the stage has not been run */
LH_API lh_status lh_capture_evaluation(lh_context *ctx, const lh_capture *capture, char *buffer, size_t size,
                                       size_t *needed);

/* ---- import, export ---------------------------------------------------------------------------------------------- */

typedef struct lh_import_options {
  size_t struct_size;
  int32_t reference;  /**< yes: refer to photographs where they are instead of copying them */
  double pixel_shift; /**< projections: added to their pixels so that the first one's centre becomes 0.5: 0 where it is
                           already, 0.5 where the matrices say 0 (OpenCV), -0.5 where they say 1 (MATLAB) */
  double
      max_refit_error_px; /**< NeRF, COLMAP: lenses of other models are refitted; the largest error allowed; 0: 0.5 */
} lh_import_options;

/*
 * Importers make a new capture in `folder`, which does not exist yet or is empty. A failed or cancelled import leaves
 * no half of one. What they had to decide (a mirrored world, refitted lenses) stands under "notes" in
 * lh_capture_describe. All: LH_EINVAL: the folder is in use; LH_ENOTFOUND, LH_EINPUT: names the file, line or JSON
 * pointer; LH_ECANCELLED.
 */

/** "NAME p11 p12 … p34" a line, any scale, sign and handedness; names relative to the listing.
 *  @return LH_EDEGENERATE: all rays parallel, so that handedness can't be told */
LH_API lh_status lh_capture_import_projections(lh_context *ctx, const char *listing, const char *folder,
                                               const lh_import_options *options, lh_capture **out);
/** A Middlebury multi-view file, *_par.txt. */
LH_API lh_status lh_capture_import_middlebury(lh_context *ctx, const char *file, const char *folder,
                                              const lh_import_options *options, lh_capture **out);
/** NeRF's transforms*.json, n files; an alpha channel becomes the mask. */
LH_API lh_status lh_capture_import_nerf(lh_context *ctx, const char *const *files, size_t n, const char *folder,
                                        const lh_import_options *options, lh_capture **out);
/** A COLMAP model's folder, text or binary; photos: the folder that its image names are relative to.
 *  @return LH_EUNSUPPORTED: a camera model that is not known */
LH_API lh_status lh_capture_import_colmap(lh_context *ctx, const char *model, const char *photos, const char *folder,
                                          const lh_import_options *options, lh_capture **out);
/** n photographs without poses. */
LH_API lh_status lh_capture_import_photos(lh_context *ctx, const char *const *files, size_t n, const char *folder,
                                          const lh_import_options *options, lh_capture **out);
/** Adds masks, named like their photographs, from a folder to a capture and saves it. count: NULL, or how many.
 *  @return LH_ENOTFOUND: no picture fits any shot; LH_EINPUT: a size that is not the photograph's, a colour picture */
LH_API lh_status lh_capture_import_masks(lh_context *ctx, lh_capture *capture, const char *folder, size_t *count);
/** Adds n photographs of the empty enclosure, which keying learns the background from, and saves the capture. */
LH_API lh_status lh_capture_import_enclosure(lh_context *ctx, lh_capture *capture, const char *const *files, size_t n,
                                             int32_t reference);

/** A COLMAP text model into a new or empty folder; where the capture has a target model, with the targets as its points.
 *  max_refit_error_px: of a lens in the other model, 0: 0.5;
 *  largest_error_px: NULL, or what it came to.
 *  @return LH_EUNSUPPORTED: a camera that can't be expressed; LH_EINPUT: no photograph has a pose */
LH_API lh_status lh_capture_export_colmap(lh_context *ctx, const lh_capture *capture, const char *folder,
                                          double max_refit_error_px, double *largest_error_px);
/** NeRF's transforms.json. The same parameters and errors. */
LH_API lh_status lh_capture_export_nerf(lh_context *ctx, const lh_capture *capture, const char *file,
                                        double max_refit_error_px, double *largest_error_px);

/* ---- new views --------------------------------------------------------------------------------------------------- */

/** Renders new views of a capture that has a hull, or of a model's file. Photographs are read when first needed and
 * kept for the next view. */
typedef struct lh_renderer lh_renderer;

/** method: "light_field" shows the factored model in light_field.glb; "lumigraph" blends photographs on the hull;
 *  "mean_texture" shows the model in textured.glb; "shaded" the bare hull in grey. What it needs of the capture is
 *  copied. @return LH_ENOTFOUND: the stage that makes it has not been run */
LH_API lh_status lh_renderer_create(lh_context *ctx, const lh_capture *capture, const char *method, lh_renderer **out);
/** A model by its file alone, no capture: a light_field.glb as its light field, any other .glb of Lumihull's as its
 *  texture. A turntable's up and first frame are then what the light field knows of its photographs, else z and x.
 *  @return LH_ENOTFOUND; LH_EINPUT: no such model; LH_EUNSUPPORTED: another version, or a glTF file of another kind */
LH_API lh_status lh_renderer_open(lh_context *ctx, const char *file, lh_renderer **out);
LH_API void lh_renderer_destroy(lh_renderer *renderer);

/** For speed, in the views from now on; no at first. adaptive: yes: the rays x rays rays are cast only where one of the
 *  object's outlines passes through a pixel, or a pixel is not well inside of a triangle; elsewhere one ray finds the
 *  triangle, and samples are taken on its plane. Alpha is the same as without; colours and depth nearly so. */
LH_API lh_status lh_renderer_set_adaptive(lh_context *ctx, lh_renderer *renderer, int32_t adaptive);

/**
 * Renders a view.
 *
 * @param camera         any size and lens
 * @param cam_from_world 12
 * @param rays           rays x rays a pixel, 1 … 8; 0: 2
 * @param rgba           height x width x 4, 8-bit sRGB, straight alpha: the share of a pixel's rays that hit the object
 * @param rgba_size      bytes that rgba has: at least height x width x 4
 * @param depth          NULL, or height x width: least z in the camera's frame, infinite where nothing was hit
 */
LH_API lh_status lh_renderer_render(lh_context *ctx, lh_renderer *renderer, const lh_camera *camera,
                                    const double cam_from_world[12], int32_t rays, uint8_t *rgba, size_t rgba_size,
                                    float *depth);

/**
 * Cameras for a full turn around the object, which fits into every picture; up is what the photographs have as up.
 *
 * @param frames         1 … 100,000
 * @param width, height  of the pictures, px
 * @param elevation_rad  above the horizon, -pi/2 … pi/2
 * @param camera         that of all frames; its struct_size says how much of it is filled
 * @param cam_from_world frames x 12
 */
LH_API lh_status lh_renderer_turntable(lh_context *ctx, const lh_renderer *renderer, size_t frames, int32_t width,
                                       int32_t height, double elevation_rad, lh_camera *camera, double *cam_from_world);

/* ---- how good is it ---------------------------------------------------------------------------------------------- */

/*
 * a, b: height x width x 3, 8-bit sRGB; mask: NULL, or height x width: only pixels of 128 and more count (NaN where
 * there is none).
 */

/** Peak signal-to-noise ratio in dB: 10 log10(255² / mean squared error); 100 for equal pictures. */
LH_API lh_status lh_picture_psnr(lh_context *ctx, const uint8_t *a, const uint8_t *b, const uint8_t *mask,
                                 int32_t width, int32_t height, double *out);
/** Structural similarity (Wang et al. 2004), 11 x 11, sigma 1.5; at least 11 x 11 pixels. */
LH_API lh_status lh_picture_ssim(lh_context *ctx, const uint8_t *a, const uint8_t *b, const uint8_t *mask,
                                 int32_t width, int32_t height, double *out);
/** Intersection over union of the pixels of 128 and more of two masks, height x width; 1 where both are empty. */
LH_API lh_status lh_mask_iou(lh_context *ctx, const uint8_t *a, const uint8_t *b, int32_t width, int32_t height,
                             double *out);

#ifdef __cplusplus
}
#endif

#include <lumihull_calib.h>   /* targets, resection, lens calibration */
#include <lumihull_capture.h> /* the robot: mechanism, plan */
#include <lumihull_truth.h>   /* a capture beside what is known to be true */

#endif
