// Steps scenes with Rapier: each line of standard input names a request (JSON) and a file for the states at the samples
// (bodies x (x, y, angle, vx, vy, w), f64); the answer is a line with the processor seconds of each repetition.
use rapier2d_f64::prelude::*;
use serde::Deserialize;
use std::f64::consts::PI;
use std::io::{BufRead, Write};

/// Marks an answer among other lines, as in worker.py
const ANSWER: &str = "rivals:";

#[derive(Deserialize)]
struct Request {
    scene: Scene,
    knobs: Knobs,
    samples: usize,
    steps_per_sample: usize,
    dt: f64,
    least_seconds: f64,
    most_runs: usize,
}

#[derive(Deserialize)]
struct Scene {
    gravity: [f64; 2],
    friction: f64,
    restitution: f64,
    density: f64,
    bodies: Vec<Body>,
}

#[derive(Deserialize)]
struct Body {
    vertices: Vec<[f64; 2]>,
    x: f64,
    y: f64,
    angle: f64,
    vx: f64,
    vy: f64,
    spin: f64,
    fixed: bool,
}

/// Natural frequency of the contact springs [1/s] (absent: Rapier's), and whether contacts are reused between steps
#[derive(Deserialize)]
struct Knobs {
    frequency: Option<f64>,
    recycling: bool,
}

fn processor_seconds() -> f64 {
    let mut t = libc::timespec { tv_sec: 0, tv_nsec: 0 };
    unsafe {
        libc::clock_gettime(libc::CLOCK_PROCESS_CPUTIME_ID, &mut t);
    }
    t.tv_sec as f64 + 1e-9 * t.tv_nsec as f64
}

/// The world of a request, and the handles of its bodies.
fn build(request: &Request) -> (PhysicsWorld, Vec<RigidBodyHandle>) {
    let scene = &request.scene;
    let mut world = PhysicsWorld::new();
    world.gravity = Vector::new(scene.gravity[0], scene.gravity[1]);
    let parameters = &mut world.integration_parameters;
    parameters.dt = request.dt;
    parameters.contact_recycling = request.knobs.recycling;
    if let Some(frequency) = request.knobs.frequency {
        parameters.contact_softness.natural_frequency = frequency;
        parameters.static_contact_softness.natural_frequency = 2.0 * frequency;
    }
    let mut handles = Vec::new();
    for body in &scene.bodies {
        let builder = if body.fixed { RigidBodyBuilder::fixed() } else { RigidBodyBuilder::dynamic() };
        let builder = builder
            .translation(Vector::new(body.x, body.y))
            .rotation(body.angle)
            .linvel(Vector::new(body.vx, body.vy))
            .angvel(body.spin)
            .can_sleep(false);
        let corners: Vec<Vector> = body.vertices.iter().map(|p| Vector::new(p[0], p[1])).collect();
        let collider = ColliderBuilder::convex_polyline(corners)
            .expect("a convex polygon")
            .density(scene.density)
            .friction(scene.friction)
            .restitution(scene.restitution);
        handles.push(world.insert(builder, collider).0);
    }
    (world, handles)
}

/// States at all samples, and the processor seconds of stepping.
fn run(request: &Request) -> (Vec<f64>, f64) {
    let (mut world, handles) = build(request);
    let mut angle: Vec<f64> = request.scene.bodies.iter().map(|body| body.angle).collect();
    let mut last = angle.clone();
    let (mut states, mut seconds) = (Vec::new(), 0.0);
    for sample in 0..=request.samples {
        for (k, handle) in handles.iter().enumerate() {
            let body = &world.bodies[*handle];
            let turned = body.rotation().angle();
            angle[k] += (turned - last[k] + PI).rem_euclid(2.0 * PI) - PI;
            last[k] = turned;
            let (place, velocity) = (body.translation(), body.linvel());
            states.extend_from_slice(&[place.x, place.y, angle[k], velocity.x, velocity.y, body.angvel()]);
        }
        if sample < request.samples {
            let began = processor_seconds();
            for _ in 0..request.steps_per_sample {
                world.step();
            }
            seconds += processor_seconds() - began;
        }
    }
    (states, seconds)
}

fn main() {
    for line in std::io::stdin().lock().lines() {
        let line = line.expect("a line of text");
        let (source, target) = line.split_once('\t').expect("two names");
        let text = std::fs::read_to_string(source).expect("a request");
        let request: Request = serde_json::from_str(&text).expect("a request in JSON");
        let (states, first) = run(&request);
        let mut seconds = vec![first];
        while seconds.iter().sum::<f64>() < request.least_seconds && seconds.len() < request.most_runs {
            seconds.push(run(&request).1);
        }
        let bytes: Vec<u8> = states.iter().flat_map(|x| x.to_le_bytes()).collect();
        std::fs::File::create(target).and_then(|mut file| file.write_all(&bytes)).expect("a file of states");
        let texts: Vec<String> = seconds.iter().map(|x| x.to_string()).collect();
        println!("{} {}", ANSWER, texts.join(" "));
    }
}
