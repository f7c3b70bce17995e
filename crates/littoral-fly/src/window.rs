//! The window: events in, pictures out. It never waits for the scene.

use crate::Arguments;
use crate::camera::Hands;
use crate::cockpit::Cockpit;
use crate::film::Filming;
use crate::paint::{Gui, Missed, Paint};
use crate::panel::{self, Ask, Shown};
use crate::scene::{self, News, Slot, Voice};
use crate::settings::Settings;
use glam::{UVec2, Vec2};
use smoke::Smoke;
use std::collections::HashSet;
use std::path::PathBuf;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, channel};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread::JoinHandle;
use std::time::Instant;
use winit::application::ApplicationHandler;
use winit::dpi::PhysicalSize;
use winit::event::{ElementState, MouseButton, MouseScrollDelta, WindowEvent};
use winit::event_loop::{ActiveEventLoop, ControlFlow, EventLoop, EventLoopProxy};
use winit::keyboard::{KeyCode, PhysicalKey};
use winit::window::{Window, WindowId};

mod hands;
mod records;
mod smoke;

/// Opens the window and flies until it is closed.
pub fn run(arguments: Arguments, settings: Settings, note: Option<String>) -> Result<(), String> {
    let no_display = |e: &dyn std::fmt::Display| {
        // "os error at FILE:LINE: what went wrong"
        let text = e.to_string().replace('\n', " ");
        let what =
            text.rsplit_once(".rs:").and_then(|(_, rest)| rest.split_once(": ")).map_or(&*text, |(_, what)| what);
        let what = what.trim_end_matches('.');
        format!(
            "expected a display to open a window on, found none ({what}); start it in a desktop session, set DISPLAY or WAYLAND_DISPLAY, or draw without a window: littoral render"
        )
    };
    let events = EventLoop::<()>::with_user_event().build().map_err(|e| no_display(&e))?;
    events.set_control_flow(ControlFlow::Wait);
    let mut app = App { arguments, settings, note, wake: events.create_proxy(), flight: None, problem: None };
    events.run_app(&mut app).map_err(|e| no_display(&e))?;
    match app.problem {
        Some(problem) => Err(problem),
        None => Ok(()),
    }
}

struct App {
    arguments: Arguments,
    settings: Settings,
    note: Option<String>,
    wake: EventLoopProxy<()>,
    flight: Option<Flight>,
    problem: Option<String>,
}

/// A flight in a window.
struct Flight {
    window: Arc<Window>,
    paint: Paint,
    egui: egui_winit::State,
    cockpit: Cockpit,
    shown: Shown,
    news: Receiver<News>,
    slot: Arc<Slot>,
    scene: Option<JoinHandle<()>>,
    /// What the graphics driver complained of since the last frame.
    complaints: Arc<Mutex<Vec<String>>>,
    lost: Arc<AtomicBool>,
    held: HashSet<KeyCode>,
    #[cfg(feature = "gamepad")]
    gamepads: Option<crate::gamepad::Gamepads>,
    cursor: Vec2,
    /// The mouse button that turns the look.
    looking: Option<MouseButton>,
    /// The point of the path that is dragged.
    dragged: Option<usize>,
    dropped: Vec<PathBuf>,
    filming: Option<Filming>,
    pictures: Vec<bool>,
    before: Instant,
    /// The path to be flown as soon as there is a land.
    path: Option<PathBuf>,
    smoke: Option<Smoke>,
}

impl Flight {
    fn new(events: &ActiveEventLoop, app: &mut App) -> Result<Flight, String> {
        let arguments = &app.arguments;
        let size = PhysicalSize::new(arguments.size.x, arguments.size.y);
        let attributes = Window::default_attributes().with_title("Littoral").with_inner_size(size);
        let window = events.create_window(attributes).map_err(|e| {
            format!("expected to open a window, got an error: {e}; try another --size, or littoral render")
        })?;
        let window = Arc::new(window);
        let paint = Paint::new(&window, arguments.smoke.is_some())?;
        let complaints = Arc::new(Mutex::new(Vec::new()));
        let lost = Arc::new(AtomicBool::new(false));
        {
            let (complaints, lost) = (complaints.clone(), lost.clone());
            paint.gpu.device.on_uncaptured_error(Arc::new(move |error| {
                let text = error.to_string().split_whitespace().collect::<Vec<_>>().join(" ");
                complaints.lock().unwrap_or_else(PoisonError::into_inner).push(text);
            }));
            paint.gpu.device.set_device_lost_callback(move |_, _| lost.store(true, Ordering::Relaxed));
        }
        let context = egui::Context::default();
        context.set_theme(egui::Theme::Dark);
        // Over pictures of any colour, text must be bright.
        let mut visuals = egui::Visuals::dark();
        visuals.override_text_color = Some(egui::Color32::from_gray(225));
        visuals.weak_text_color = Some(egui::Color32::from_gray(165));
        context.set_visuals_of(egui::Theme::Dark, visuals);
        let egui = egui_winit::State::new(context, egui::ViewportId::ROOT, &window, None, None, None);
        let mut cockpit = Cockpit::new(app.settings.clone(), arguments.files.clone());
        cockpit.order.lakes.clone_from(&arguments.lake);
        cockpit.order.objects.clone_from(&arguments.object);
        if paint.gpu.is_software() && arguments.coarse.is_none() && cockpit.settings.coarse == 1 {
            // Without a graphics card, light for every pixel of a window takes too long.
            cockpit.settings.coarse = 4;
        }
        // And a picture of which a part always moves would never get sharp.
        cockpit.still = paint.gpu.is_software();
        if let Some(note) = app.note.take() {
            cockpit.note(note);
        }
        let (sender, news) = channel();
        let slot = Arc::new(Slot::default());
        let wake = app.wake.clone();
        let voice = Voice::new(sender, move || {
            let _ = wake.send_event(()); // a window that is gone needs no waking
        });
        let (its, gpu) = (slot.clone(), paint.gpu.clone());
        let scene = std::thread::Builder::new()
            .name("scene".into())
            .spawn(move || scene::run(&its, &voice, &gpu))
            .map_err(|e| format!("expected to start a thread, got an error: {e}; close other programs"))?;
        let adapter = format!("{} ({})", paint.gpu.adapter.name, paint.gpu.adapter.backend);
        let smoke = arguments.smoke.map(Smoke::new);
        Ok(Flight {
            window,
            paint,
            egui,
            cockpit,
            shown: Shown { adapter, ..Shown::default() },
            news,
            slot,
            scene: Some(scene),
            complaints,
            lost,
            held: HashSet::new(),
            #[cfg(feature = "gamepad")]
            gamepads: crate::gamepad::Gamepads::new(),
            cursor: Vec2::ZERO,
            looking: None,
            dragged: None,
            dropped: Vec::new(),
            filming: None,
            pictures: Vec::new(),
            before: Instant::now(),
            path: arguments.path.clone(),
            smoke,
        })
    }

    /// One frame. An error ends the program.
    fn frame(&mut self, events: &ActiveEventLoop) -> Result<(), String> {
        if self.lost.load(Ordering::Relaxed) {
            return Err("the graphics device was lost (driver restarted or unplugged?); start again".into());
        }
        let complaints = std::mem::take(&mut *self.complaints.lock().unwrap_or_else(PoisonError::into_inner));
        complaints.into_iter().for_each(|text| self.cockpit.note(format!("graphics: {text}")));
        let now = Instant::now();
        let passed = now.duration_since(self.before).as_secs_f64();
        self.before = now;
        self.listen();
        if !self.dropped.is_empty() {
            let files = std::mem::take(&mut self.dropped);
            self.cockpit.drop_files(files);
        }
        let size = self.paint.size();
        let hands = match &self.smoke {
            // Always the same way, whatever the clock says.
            Some(_) => Hands { forward: 0.3, turn: 0.3, ..Default::default() },
            None => self.hands(events),
        };
        if self.filming.is_none() {
            self.cockpit.steer(passed * 1e3);
        }
        match &mut self.filming {
            Some(filming) => filming.pose(&mut self.cockpit),
            None if self.smoke.is_some() => self.cockpit.advance(&hands, 1.0 / 60.0),
            None => self.cockpit.advance(&hands, passed),
        }
        let mut gui = self.gui(size);
        self.paint.take_textures(&mut gui);
        self.slot.wish(self.cockpit.wish(size));
        match self.paint.show(&self.cockpit, &gui) {
            Ok(rests) => {
                self.cockpit.rests = rests;
                self.cockpit.difference = self.paint.difference();
                self.cockpit.history.uploaded(self.paint.take_uploads());
                self.count(passed, events)?;
            }
            Err(Missed::Frame) => std::thread::sleep(std::time::Duration::from_millis(5)),
            Err(Missed::Lost(problem)) => return Err(problem),
        }
        for panel in std::mem::take(&mut self.pictures) {
            self.picture(panel.then_some(&gui));
        }
        self.film();
        Ok(())
    }

    /// Takes what the scene told.
    fn listen(&mut self) {
        while let Ok(news) = self.news.try_recv() {
            let arrived = matches!(news, News::Arrived(..));
            self.cockpit.hear(news);
            if arrived {
                let name = self.cockpit.subject.as_ref().map_or("", |subject| &subject.name);
                self.window.set_title(&format!("Littoral: {name}"));
                if let Some(path) = self.path.take() {
                    self.cockpit.load_path(&path);
                    self.cockpit.play();
                }
            }
        }
        if self.scene.as_ref().is_some_and(JoinHandle::is_finished) {
            self.scene = None;
            self.cockpit.working = None;
            self.cockpit
                .note("the scene stopped (an internal error; please report it): save your path, and start again");
        }
    }

    /// Whether the mouse is over something of the panel's.
    fn is_over_panel(&self) -> bool {
        let context = self.egui.egui_ctx();
        let at = self.cursor / context.pixels_per_point();
        self.shown.covers(context, egui::pos2(at.x, at.y))
    }

    /// Runs the panel.
    fn gui(&mut self, size: UVec2) -> Gui {
        let mut asks = Vec::new();
        let input = self.egui.take_egui_input(&self.window);
        let context = self.egui.egui_ctx().clone();
        let (cockpit, shown) = (&mut self.cockpit, &mut self.shown);
        let output = context.run_ui(input, |ui| panel::show(ui, cockpit, shown, size, &mut asks));
        self.egui.handle_platform_output(&self.window, output.platform_output);
        for ask in asks {
            match ask {
                Ask::Picture => self.pictures.push(false),
                Ask::Film => self.toggle_film(),
                Ask::Freeze => self.cockpit.freeze(size),
            }
        }
        let scale = output.pixels_per_point;
        Gui { primitives: context.tessellate(output.shapes, scale), textures: output.textures_delta, scale }
    }
}

impl ApplicationHandler for App {
    fn resumed(&mut self, events: &ActiveEventLoop) {
        if self.flight.is_none() {
            match Flight::new(events, self) {
                Ok(flight) => self.flight = Some(flight),
                Err(problem) => {
                    self.problem = Some(problem);
                    events.exit();
                }
            }
        }
    }

    fn window_event(&mut self, events: &ActiveEventLoop, _: WindowId, event: WindowEvent) {
        let Some(flight) = &mut self.flight else { return };
        // Tab opens and closes the panel; egui would wander through its fields.
        let tab = matches!(&event, WindowEvent::KeyboardInput { event, .. } if event.physical_key == KeyCode::Tab);
        if !tab {
            let _ = flight.egui.on_window_event(&flight.window, &event);
        }
        let context = flight.egui.egui_ctx().clone();
        match event {
            WindowEvent::CloseRequested => events.exit(),
            WindowEvent::Resized(size) => flight.paint.resize(UVec2::new(size.width, size.height)),
            WindowEvent::Focused(false) => {
                flight.held.clear();
                (flight.looking, flight.dragged) = (None, None);
            }
            WindowEvent::KeyboardInput { event, .. } => {
                let PhysicalKey::Code(key) = event.physical_key else { return };
                match event.state {
                    ElementState::Released => {
                        flight.held.remove(&key);
                    }
                    // What is typed into a field is no command.
                    ElementState::Pressed if context.egui_wants_keyboard_input() => {}
                    ElementState::Pressed => {
                        flight.held.insert(key);
                        if !event.repeat {
                            flight.pressed(key, events);
                        }
                    }
                }
            }
            WindowEvent::CursorMoved { position, .. } => {
                flight.moved(Vec2::new(position.x as f32, position.y as f32));
            }
            WindowEvent::MouseInput { state, button, .. } => {
                let down = state == ElementState::Pressed;
                if !down || !flight.is_over_panel() {
                    flight.button(button, down);
                }
            }
            WindowEvent::MouseWheel { delta, .. } if !flight.is_over_panel() => {
                flight.wheel(match delta {
                    MouseScrollDelta::LineDelta(_, lines) => f64::from(lines),
                    MouseScrollDelta::PixelDelta(pixels) => pixels.y / 50.0,
                });
            }
            WindowEvent::DroppedFile(file) => flight.dropped.push(file),
            WindowEvent::RedrawRequested => {
                if let Err(problem) = flight.frame(events) {
                    self.problem = Some(problem);
                    events.exit();
                }
            }
            _ => {}
        }
    }

    fn about_to_wait(&mut self, events: &ActiveEventLoop) {
        if let Some(flight) = self.flight.as_ref().filter(|_| !events.exiting()) {
            flight.window.request_redraw();
        }
    }

    fn exiting(&mut self, _: &ActiveEventLoop) {
        let Some(mut flight) = self.flight.take() else { return };
        if let Some(filming) = flight.filming.take() {
            let _ = filming.end(&mut flight.cockpit.time); // nobody reads notes any more
        }
        flight.slot.end();
        if let (None, Some(file)) = (&flight.smoke, Settings::file())
            && let Err(problem) = flight.cockpit.settings.save(&file)
        {
            eprintln!("littoral-fly: {problem}");
        }
        // A land that is being opened is not waited for; the scene ends with its frame.
        if let Some(scene) = flight.scene.take()
            && flight.cockpit.working.is_none()
        {
            let _ = scene.join();
        }
    }
}
