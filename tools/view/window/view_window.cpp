#include "tools/view/window/view_window.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <memory>
#include <numeric>
#include <ostream>
#include <string>
#include <string_view>
#include <thread>

#include <GLFW/glfw3.h>
#include <backends/imgui_impl_glfw.h>
#include <backends/imgui_impl_opengl3.h>
#include <imgui.h>

#include "tools/program/interrupt.h"
#include "tools/view/voice_display.h"
#include "tools/view/window/controls.h"
#include "tools/view/window/keyboard.h"
#include "tools/view/window/panels.h"
#include "tools/view/window/scene_renderer.h"
#include "tools/view/window/screenshot.h"
#include "tools/view/window/script_input.h"

namespace clamor {

namespace {

using Clock = std::chrono::steady_clock;

constexpr double kLook_rad_per_px = 0.0032;
constexpr float kClick_px = 4;  // a press that moves further is a drag
constexpr auto kFrame = std::chrono::milliseconds(16), kIdleFrame = std::chrono::milliseconds(50),
               kSlowFrame = std::chrono::milliseconds(100);
constexpr auto kIdleAfter = std::chrono::seconds(1);

std::string last_problem;  // as GLFW words it

// GLFW, from the first window to the last.
class Library {
 public:
  static Result<std::unique_ptr<Library>> open() {
    glfwSetErrorCallback([](int, const char* text) { last_problem = text; });
    if (glfwInit() == GLFW_FALSE)
      return Error("no window can be opened: " + last_problem +
                   ". Is there a display? Over ssh, 'ssh -X' or 'xvfb-run' gives one.");
    return std::unique_ptr<Library>(new Library());
  }
  ~Library() { glfwTerminate(); }

 private:
  Library() = default;
};

// Dear ImGui's context and its backends.
class Interface {
 public:
  explicit Interface(GLFWwindow* window) {
    ImGui::CreateContext();
    ImGui::GetIO().IniFilename = nullptr;  // nothing is written beside the level
    ImGui::GetIO().ConfigFlags |= ImGuiConfigFlags_NavEnableKeyboard;
    ImGui_ImplGlfw_InitForOpenGL(window, true);
    ImGui_ImplOpenGL3_Init("#version 330 core");
  }
  ~Interface() {
    ImGui_ImplOpenGL3_Shutdown();
    ImGui_ImplGlfw_Shutdown();
    ImGui::DestroyContext();
  }
  Interface(const Interface&) = delete;
  Interface& operator=(const Interface&) = delete;
};

// Whether Mesa draws the current context's pictures with the processor.
bool draws_in_software() {
  const auto* const name = reinterpret_cast<const char*>(glGetString(GL_RENDERER));
  return name != nullptr && std::string_view(name).find("llvmpipe") != std::string_view::npos;
}

// Null if there is no OpenGL 3.3. Its context is then current.
GLFWwindow* make_window(const ViewSession& session, const WindowOptions& options) {
  GLFWwindow* const window = glfwCreateWindow(
      options.width, options.height, ("clamor: " + session.title()).c_str(), nullptr, nullptr);
  if (window == nullptr) return nullptr;
  glfwMakeContextCurrent(window);
  glfwSetWindowSizeLimits(window, kLeastWindowWidth, kLeastWindowHeight, GLFW_DONT_CARE,
                          GLFW_DONT_CARE);
  return window;
}

// The lines that the window draws in the level: the outline of what is selected, and portals, as
// far open as they are.
std::vector<SceneLines> scene_lines(const ViewSession& session) {
  constexpr Vec3f kPortal(0.38f, 0.62f, 1.0f), kSelected(1.0f, 0.62f, 0.18f);
  using Kind = Selection::Kind;
  const Selection& chosen = session.selection();
  std::vector<SceneLines> lines;
  for (std::size_t p = 0; p < session.portals().size(); ++p)
    lines.push_back({lines_of(session.portals()[p], session.doors().portals()[p].share),
                     chosen.kind == Kind::kPortal && chosen.index == p ? kSelected : kPortal});
  if (chosen.kind == Kind::kSurface) lines.push_back({session.outline(), kSelected});
  if (chosen.kind == Kind::kPart) {
    const Mesh part = session.part_mesh(chosen.index);
    std::vector<std::uint32_t> all(part.triangles.size());
    std::iota(all.begin(), all.end(), 0u);
    lines.push_back({outline_of(part, all), kSelected});
  }
  return lines;
}

double pressed(std::initializer_list<int> keys) {
  return std::ranges::any_of(keys, is_key_down) ? 1 : 0;
}

WalkKeys walk_keys() {
  WalkKeys keys;
  const ImGuiIO& io = ImGui::GetIO();
  if (io.WantTextInput || io.KeyCtrl) return keys;
  keys.ahead = pressed({GLFW_KEY_W, GLFW_KEY_UP}) - pressed({GLFW_KEY_S, GLFW_KEY_DOWN});
  keys.right = pressed({GLFW_KEY_D}) - pressed({GLFW_KEY_A});
  keys.up = pressed({GLFW_KEY_R}) - pressed({GLFW_KEY_F});
  keys.turn_left = pressed({GLFW_KEY_LEFT}) - pressed({GLFW_KEY_RIGHT});
  keys.fast = io.KeyShift;
  return keys;
}

class Window {
 public:
  Window(GLFWwindow* window, ViewSession& session, const WindowOptions& options)
      : window_(window),
        session_(session),
        options_(options),
        interface_(window),
        fonts_(apply_theme(scale())),
        panels_(session, fonts_),
        script_(options_.script) {
    glfwSetWindowUserPointer(window_, this);
    glfwSetDropCallback(window_, [](GLFWwindow* window, int count, const char** paths) {
      auto* const self = static_cast<Window*>(glfwGetWindowUserPointer(window));
      for (int i = 0; i < count; ++i) self->panels_.add_emitter(paths[i]);
    });
  }

  Result<void> run(std::ostream& out);

 private:
  float scale() const {
    if (options_.scale > 0) return static_cast<float>(options_.scale);
    float x = 1, y = 1;
    glfwGetWindowContentScale(window_, &x, &y);
    return std::clamp(std::max(x, y), 1.0f, 4.0f);
  }
  Result<void> frame(std::ostream& out);
  void show_changes();
  void steer(const WindowLayout& layout);
  void use_keys();
  Clock::duration frame_time() const;

  GLFWwindow* const window_;
  ViewSession& session_;
  const WindowOptions& options_;
  const Interface interface_;
  const Fonts fonts_;
  bool is_software_ = false;  // pictures take the cores that bakes and sound need
  Panels panels_;
  ScriptInput script_;
  std::unique_ptr<SceneRenderer> renderer_;
  VoiceDisplay voices_;
  Clock::time_point last_ = Clock::now(), used_ = Clock::now();
  ImVec2 pressed_at_{};
  bool press_is_click_ = false, looks_ = false;
  Selection outlined_;
  std::uint64_t shown_revision_ = 0, door_revision_ = 0;
};

// The mouse over the level: a click selects, a drag with the right button looks round.
void Window::steer(const WindowLayout& layout) {
  const ImGuiIO& io = ImGui::GetIO();
  const bool is_over = !io.WantCaptureMouse && io.MousePos.x >= 0 &&
                       io.MousePos.x < layout.view_width() && io.MousePos.y >= layout.toolbar &&
                       io.MousePos.y < layout.toolbar + layout.view_height();
  if (is_over && ImGui::IsMouseClicked(0)) {
    pressed_at_ = io.MousePos;
    press_is_click_ = true;
  }
  if (is_over && ImGui::IsMouseClicked(1)) looks_ = true;
  if (!io.MouseDown[1]) looks_ = false;
  if (looks_)
    session_.camera().look(-kLook_rad_per_px * static_cast<double>(io.MouseDelta.x),
                           -kLook_rad_per_px * static_cast<double>(io.MouseDelta.y));
  const float moved = std::hypot(io.MousePos.x - pressed_at_.x, io.MousePos.y - pressed_at_.y);
  if (press_is_click_ && ImGui::IsMouseReleased(0)) {
    press_is_click_ = false;
    if (is_over && moved <= kClick_px * scale())
      session_.select_at(
          static_cast<double>(io.MousePos.x / layout.view_width()),
          static_cast<double>((io.MousePos.y - layout.toolbar) / layout.view_height()),
          layout.aspect());
  }
}

void Window::use_keys() {
  const ImGuiIO& io = ImGui::GetIO();
  if (io.WantTextInput) return;
  if (io.KeyCtrl && is_key_pressed(GLFW_KEY_S, false)) panels_.save();
  if (io.KeyCtrl && is_key_pressed(GLFW_KEY_Z, true)) {
    if (io.KeyShift)
      session_.redo();
    else
      session_.undo();
  }
  if (io.KeyCtrl && is_key_pressed(GLFW_KEY_Y, true)) session_.redo();
  if (!io.KeyCtrl && is_key_pressed(GLFW_KEY_TAB, false))
    session_.set_plays_other(!session_.plays_other());
  if (!io.KeyCtrl && is_key_pressed(GLFW_KEY_O, false)) session_.toggle_door();
  if (is_key_pressed(GLFW_KEY_ESCAPE, false) && !ImGui::IsPopupOpen("", ImGuiPopupFlags_AnyPopup)) {
    session_.select({});
    session_.remove_mark();
  }
}

Clock::duration Window::frame_time() const {
  if (is_software_ && session_.baking().is_busy) return kSlowFrame;
  return Clock::now() - used_ > kIdleAfter ? kIdleFrame : kFrame;
}

// Hands what has changed in the session to the renderer.
void Window::show_changes() {
  if (shown_revision_ != session_.shape_revision()) {
    shown_revision_ = session_.shape_revision();
    renderer_->set_level(session_.vertices());
  }
  if (door_revision_ == session_.door_revision() && outlined_ == session_.selection()) return;
  door_revision_ = session_.door_revision();
  outlined_ = session_.selection();
  renderer_->set_parts(session_.part_vertices());
  renderer_->set_lines(scene_lines(session_));
}

Result<void> Window::frame(std::ostream& out) {
  if (int width = 0, height = 0; script_.take_size(width, height))
    glfwSetWindowSize(window_, width, height);
  ImGui_ImplOpenGL3_NewFrame();
  ImGui_ImplGlfw_NewFrame();
  ImGuiIO& io = ImGui::GetIO();
  const WindowLayout layout = WindowLayout::of(io.DisplaySize.x, io.DisplaySize.y, scale());
  if (script_.is_active()) {
    const auto place = [&](const Vec3& point_m, ImVec2& at) {
      return layout.place(session_.camera(), point_m, at);
    };
    if (auto played = script_.frame(session_, out, place); !played.ok()) return played;
  }
  if (const std::string dropped = script_.take_dropped(); !dropped.empty())
    panels_.add_emitter(dropped);
  ImGui::NewFrame();
  // Tab switches between two bakes. It must not begin to edit the number of a slider as well, in
  // which further keys would go.
  keep_tab();
  control_places().clear();
  steer(layout);
  use_keys();

  const auto now = Clock::now();
  const double seconds = std::chrono::duration<double>(now - last_).count();
  last_ = now;
  const bool is_used = io.MouseDelta.x != 0 || io.MouseDelta.y != 0 || io.MouseDown[0] ||
                       is_any_key_down() || session_.camera().is_moving();
  if (is_used) used_ = now;
  session_.frame(walk_keys(), seconds);
  voices_.update(session_.heard(), seconds);
  panels_.draw(layout, voices_);
  ImGui::Render();

  int width = 0, height = 0;
  glfwGetFramebufferSize(window_, &width, &height);
  const float ratio = io.DisplayFramebufferScale.x;
  const auto px = [ratio](float units) { return static_cast<int>(std::lround(units * ratio)); };
  glViewport(0, 0, width, height);
  glClearColor(0.106f, 0.114f, 0.129f, 1);
  glClear(GL_COLOR_BUFFER_BIT);
  show_changes();
  const bool is_surface = outlined_.kind == Selection::Kind::kSurface;
  renderer_->draw({0, px(layout.bottom), px(layout.view_width()), px(layout.view_height())},
                  {session_.camera(), voices_.points(),
                   is_surface ? static_cast<int>(outlined_.index) : -1, layout.scale * ratio});
  ImGui_ImplOpenGL3_RenderDrawData(ImGui::GetDrawData());
  if (const std::string path = script_.take_screenshot(); !path.empty())
    if (auto written = write_screenshot(path, width, height); !written.ok()) return written;
  glfwSwapBuffers(window_);
  return {};
}

Result<void> Window::run(std::ostream& out) {
  auto renderer = SceneRenderer::create();
  if (!renderer.ok()) return renderer.error();
  renderer_ = std::move(*renderer);
  renderer_->set_level(session_.vertices());
  shown_revision_ = session_.shape_revision();
  is_software_ = draws_in_software();
  const Interrupt interrupt;
  while (!panels_.wants_to_quit() && !script_.wants_to_quit() && !Interrupt::requested()) {
    const auto began = Clock::now();
    glfwPollEvents();
    if (glfwWindowShouldClose(window_) == GLFW_TRUE) {
      glfwSetWindowShouldClose(window_, GLFW_FALSE);
      panels_.ask_to_quit();
    }
    if (auto drawn = frame(out); !drawn.ok()) return drawn;
    std::this_thread::sleep_until(began + frame_time());
  }
  return session_.sound().stop();
}

}  // namespace

Result<void> run_view_window(ViewSession& session, const WindowOptions& options,
                             std::ostream& out) {
  const auto library = Library::open();
  if (!library.ok()) return library.error();
  glfwWindowHint(GLFW_CONTEXT_VERSION_MAJOR, 3);
  glfwWindowHint(GLFW_CONTEXT_VERSION_MINOR, 3);
  glfwWindowHint(GLFW_OPENGL_PROFILE, GLFW_OPENGL_CORE_PROFILE);
  glfwWindowHint(GLFW_OPENGL_FORWARD_COMPAT, GLFW_TRUE);
  glfwWindowHint(GLFW_SAMPLES, 4);
  glfwWindowHint(GLFW_SCALE_TO_MONITOR, GLFW_TRUE);
  GLFWwindow* window = make_window(session, options);
  if (window != nullptr && draws_in_software()) {  // smooth edges would take the cores of bakes
    glfwDestroyWindow(window);
    glfwWindowHint(GLFW_SAMPLES, 0);
    window = make_window(session, options);
  }
  if (window == nullptr)
    return Error("no window with OpenGL 3.3 can be opened: " + last_problem +
                 ". Is there a display, and a graphics driver (libgl1-mesa-dri)?");
  glfwSwapInterval(1);
  Result<void> ran;
  {
    Window shown(window, session, options);
    ran = shown.run(out);
  }
  glfwDestroyWindow(window);
  return ran;
}

}  // namespace clamor
